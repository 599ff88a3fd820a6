// Mixes pictures and coefficients. A picture whose shutters combine frames in several ways is composed once for each way.
uniform ivec2 size;
#ifdef SELECT
// Picks the coefficients of some shutters, scaled to a sum of 1, and stores their share of all coefficients.
// chosen: GROUPS of four shutter numbers, -1 where there is none; ALL: the number of all shutters; count: of those chosen.
layout(rgba32f) uniform readonly image2DArray coefficients;
layout(rgba32f) uniform writeonly image2DArray selected;
layout(r32f) uniform writeonly image2DArray share;
layout(std140) uniform Chosen { vec4 chosen[GROUPS]; };
uniform int count;

void at(ivec3 p) {
  float sum = 0.0;
  for (int k = 0; k < ALL; k++) {
    sum += max(imageLoad(coefficients, ivec3(p.xy, k / 4))[k % 4], 0.0);
  }
  float own = 0.0;
  vec4 found[GROUPS];
  for (int g = 0; g < GROUPS; g++) {
    found[g] = vec4(0.0);
    for (int k = 0; k < 4; k++) {
      int number = int(chosen[g][k]);
      int there = max(number, 0);
      float value = max(imageLoad(coefficients, ivec3(p.xy, there / 4))[there % 4], 0.0);
      found[g][k] = number < 0 ? 0.0 : value;
      own += found[g][k];
    }
  }
  for (int g = 0; g < GROUPS; g++) {
    vec4 equal_parts = vec4(greaterThanEqual(chosen[g], vec4(0.0))) / float(count);
    imageStore(selected, ivec3(p.xy, g), own > 0.0 ? found[g] / own : equal_parts);
  }
  imageStore(share, p, vec4(own / sum));
}
#else
// Adds a share of `part` to `mixed`: pictures (scene-linear, bottom row first) or coefficients. `share` has the top row
// first, one texel for blocks of 2^block_bits pixels. BEGINS: the first part. LEVELS: the last one, which makes levels.
layout(rgba32f) uniform readonly image2DArray part;
layout(r32f) uniform readonly image2DArray share;
#if BEGINS
layout(rgba32f) uniform writeonly image2DArray mixed;
#elif LEVELS
layout(rgba32f) uniform readonly image2DArray mixed;
#else
layout(rgba32f) uniform image2DArray mixed;
#endif
uniform ivec2 given;  // the size of `part`: coefficients of the whole picture have one texel
uniform int block_bits;
#include "light.glsl"
#if LEVELS
#  include "finish.glsl"
#endif

void at(ivec3 p) {
  ivec3 place = ivec3(p.x, size.y - 1 - p.y, p.z);
  vec4 light = imageLoad(share, ivec3(p.xy >> block_bits, 0)).r * imageLoad(part, ivec3(min(place.xy, given - 1), p.z));
#if !BEGINS
  light += imageLoad(mixed, place);
#endif
#if LEVELS
  finish(p.xy, light);
#else
  imageStore(mixed, place, light);
#endif
}
#endif
#include "pixels.glsl"
