// Adds a share of coefficients to a sum of them, four shutters of a pixel.
layout(rgba32f) uniform readonly image2DArray added;
#if BEGINS
layout(rgba32f) uniform writeonly image2DArray mixed;
#else
layout(rgba32f) uniform image2DArray mixed;
#endif
uniform ivec2 size, given;
uniform float share;

void at(ivec3 p) {
  // Coefficients of the whole picture have one texel.
  vec4 sum = share * imageLoad(added, ivec3(min(p.xy, given - 1), p.z));
#if !BEGINS
  sum += imageLoad(mixed, p);
#endif
  imageStore(mixed, p, sum);
}

#include "pixels.glsl"
