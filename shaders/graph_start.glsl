// A Jacobi step from nothing.
#include "graph.glsl"

void main()
{
  int n = node();
  if (n < count) {
    imageStore(result, at(n, layer()), damping / imageLoad(nodes, at(n, 0)).x * imageLoad(right, at(n, layer())));
  }
}
