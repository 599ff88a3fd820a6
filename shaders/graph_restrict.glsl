// The right side of the next graph: what the equations of each node's children still miss. Invocations run over the
// next graph's nodes.
#include "graph.glsl"
#include "graph_applied.glsl"

void main()
{
  int n = node();
  if (n >= count) {
    return;
  }
  ivec3 p = at(n, layer());
  vec4 total = vec4(0.0);
  vec4 span = imageLoad(families, at(n, 0));
  for (int k = int(span.x); k < int(span.y); k++) {
    int child = int(imageLoad(children, at(k, 0)).r);
    total += imageLoad(right, at(child, p.z)) - applied(child, p.z);
  }
  imageStore(result, p, total);
}
