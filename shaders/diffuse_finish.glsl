// Coefficients of sum 1; shares that stand for nothing are dropped, so that an enclosed region gets one shutter alone.
#include "diffuse.glsl"

vec4 kept(ivec3 p)
{
  vec4 value = imageLoad(solution, p);
  return value * vec4(greaterThanEqual(value, vec4(nothing)));
}

void main()
{
  ivec2 p = corner(size) + in_eights();
  if (!inside(p, size)) {
    return;
  }
  float sum = 0.0;
  for (int layer = 0; layer < layers; layer++) {
    sum += dot(kept(ivec3(p, layer)), vec4(1.0));
  }
  for (int layer = 0; layer < layers; layer++) {
    vec4 first_one = vec4(layer == 0 ? 1.0 : 0.0, 0.0, 0.0, 0.0);
    imageStore(solution, ivec3(p, layer), sum > 0.0 ? kept(ivec3(p, layer)) / sum : first_one);
  }
}
