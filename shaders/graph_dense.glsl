// The coarsest graph's solution: its inverse matrix, four columns to a texel, times the right side.
#include "graph.glsl"

void main()
{
  int n = node();
  if (n >= count) {
    return;
  }
  vec4 total = vec4(0.0);
  for (int k = 0; k < count; k += 4) {
    vec4 row = imageLoad(inverse, ivec3(k >> 2, n, 0));
    for (int i = 0; i < 4; i++) {
      if (k + i < count) {
        total += row[i] * imageLoad(right, at(k + i, layer()));
      }
    }
  }
  imageStore(result, at(n, layer()), total);
}
