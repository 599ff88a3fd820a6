// Coefficients of sum 1 for every pixel: those of its node, or its label's; shares that stand for nothing are dropped.
// pixels: the node's number, or −1 − shutter.
#include "graph.glsl"
#include "inside.glsl"

vec4 kept(int pixel, int z)
{
  vec4 value = pixel < 0 ? vec4(equal(ivec4(-1 - pixel - 4 * z), ivec4(0, 1, 2, 3))) : imageLoad(values, at(pixel, z));
  return value * vec4(greaterThanEqual(value, vec4(nothing)));
}

void main()
{
  ivec2 p = ivec2(gl_GlobalInvocationID.xy);
  if (!inside(p, size)) {
    return;
  }
  int pixel = int(imageLoad(pixels, ivec3(p, 0)).r);
  float sum = 0.0;
  for (int z = 0; z < layers; z++) {
    sum += dot(kept(pixel, z), vec4(1.0));
  }
  for (int z = 0; z < layers; z++) {
    vec4 first_one = vec4(z == 0 ? 1.0 : 0.0, 0.0, 0.0, 0.0);
    imageStore(result, ivec3(p, z), sum > 0.0 ? kept(pixel, z) / sum : first_one);
  }
}
