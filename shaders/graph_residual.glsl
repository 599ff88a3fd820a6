// What the equations still miss, or without a right side (amount 0) the matrix times the values, negative.
#include "graph.glsl"
#include "graph_applied.glsl"

void main()
{
  int n = node();
  if (n < count) {
    ivec3 p = at(n, layer());
    imageStore(result, p, amount * imageLoad(right, p) - applied(n, p.z));
  }
}
