// A Jacobi step.
#include "graph.glsl"
#include "graph_applied.glsl"

void main()
{
  int n = node();
  if (n < count) {
    ivec3 p = at(n, layer());
    vec4 missing = imageLoad(right, p) - applied(n, p.z);
    imageStore(result, p, imageLoad(values, p) + damping / imageLoad(nodes, at(n, 0)).x * missing);
  }
}
