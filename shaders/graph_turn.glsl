// The next direction of conjugate gradients. sums: residual · guess of this iteration and of the last.
#include "graph.glsl"

void main()
{
  int n = node();
  if (n >= count) {
    return;
  }
  ivec3 p = at(n, layer());
  vec4 now = imageLoad(sums, ivec3(0, 0, p.z));
  vec4 before = imageLoad(sums, ivec3(1, 0, p.z));
  vec4 share = vec4(0.0);
  for (int i = 0; i < 4; i++) {
    share[i] = before[i] > 0.0 ? now[i] / before[i] : 0.0;
  }
  vec4 turned = imageLoad(values, p);
  if (fresh == 0) {
    turned += share * imageLoad(result, p);
  }
  imageStore(result, p, turned);
}
