// Products of two sets of values, summed over every so many nodes: a part for each invocation, in a fixed order.
#include "graph.glsl"

void main()
{
  int n = node();
  if (n >= parts) {
    return;
  }
  vec4 total = vec4(0.0);
  for (int k = n; k < count; k += parts) {
    total += imageLoad(values, at(k, layer())) * imageLoad(right, at(k, layer()));
  }
  imageStore(result, at(n, layer()), total);
}
