// Makes 8-bit levels of a picture, whose bottom row is first (compute/gpu.py).
layout(rgba32f) uniform readonly image2DArray picture;
uniform ivec2 size;

#ifdef SHOW
// Levels as Blender's display makes them, top row first. Alpha is 0 where the curve is too coarse to round by.
layout(r32f) uniform readonly image2DArray grain;
// A parabola in levels for each 32nd of an octave from 2^-9 on, and its largest error.
layout(rgba32f) uniform readonly image2DArray curve;
layout(rgba8) uniform writeonly image2DArray levels;
uniform float slope;  // levels for light below the curve

bool is_sure;

float level(float light, float added) {
  uint bits = floatBitsToUint(clamp(light, LOWEST, HIGHEST));
  vec4 piece = imageLoad(curve, ivec3(int((bits >> 18u) - FIRST), 0, 0));
  float along = float(bits & 0x3ffffu) / 262144.0 - 0.5;
  float value = light < LOWEST ? light * slope : (piece.x * along + piece.y) * along + piece.z;
  value += added * 255.0 + 0.5;
  // Outside the range of levels there is nothing to round.
  is_sure = is_sure && !isnan(light) && (value < 0.5 || value > 255.9 || abs(value - round(value)) > piece.w);
  return clamp(floor(value), 0.0, 255.0) / 255.0;
}

void at(ivec3 p) {
  is_sure = true;
  ivec3 from = ivec3(p.x, size.y - 1 - p.y, 0);
  vec3 light = imageLoad(picture, from).rgb;
  float added = imageLoad(grain, from).r;
  vec3 found = vec3(level(light.r, added), level(light.g, added), level(light.b, added));
  imageStore(levels, p, vec4(found, is_sure ? 1.0 : 0.0));
}

#elif defined(PICK)
// Picks the light of some pixels. places: their numbers, row by row from the bottom.
layout(r32ui) uniform readonly uimage2DArray places;
layout(rgba32f) uniform writeonly image2DArray picked;
uniform int width;

void at(ivec3 p) {
  int place = int(imageLoad(places, p).r);
  imageStore(picked, p, imageLoad(picture, ivec3(place % width, place / width, 0)));
}

#elif defined(OVER_BLACK)
// Levels for a file, top row first: display code values (view transform Standard) over black.
layout(rgba8) uniform writeonly image2DArray levels;
#  include "light.glsl"

void at(ivec3 p) {
  vec3 linear = imageLoad(picture, ivec3(p.x, size.y - 1 - p.y, 0)).rgb;
  imageStore(levels, p, vec4(to_level(clamp(linear, 0.0, 1.0)), 1.0));
}
#endif
#include "pixels.glsl"
