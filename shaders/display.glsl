// Levels of 8 bits of a picture, whose bottom row is first (compute/gpu.py).
layout(rgba32f) uniform readonly image2DArray picture;
uniform ivec2 size;

#ifdef SHOW
// As Blender makes them, top row first, their alpha full; 0 where rounding is too near for the curve to tell.
layout(r32f) uniform readonly image2DArray grain;
// A parabola for each 32nd of an octave from 2^-9 on, in levels, and how far off it may be.
layout(rgba32f) uniform readonly image2DArray curve;
layout(rgba8) uniform writeonly image2DArray levels;
uniform float slope;  // below, in levels

bool is_sure;

float level(float light, float added) {
  uint bits = floatBitsToUint(clamp(light, LOWEST, HIGHEST));
  vec4 piece = imageLoad(curve, ivec3(int((bits >> 18u) - FIRST), 0, 0));
  float along = float(bits & 0x3ffffu) / 262144.0 - 0.5;
  float value = light < LOWEST ? light * slope : (piece.x * along + piece.y) * along + piece.z;
  value += added * 255.0 + 0.5;
  // Below and above all levels there is nothing to round; and what is no number is not sure.
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
// The light of some pixels. places: their numbers, row by row from the bottom.
layout(r32ui) uniform readonly uimage2DArray places;
layout(rgba32f) uniform writeonly image2DArray picked;
uniform int width;

void at(ivec3 p) {
  int place = int(imageLoad(places, p).r);
  imageStore(picked, p, imageLoad(picture, ivec3(place % width, place / width, 0)));
}

#elif defined(OVER_BLACK)
// Those of a file, top row first: display code values (view transform Standard) over black.
layout(rgba8) uniform writeonly image2DArray levels;
#  include "light.glsl"

void at(ivec3 p) {
  vec3 linear = imageLoad(picture, ivec3(p.x, size.y - 1 - p.y, 0)).rgb;
  imageStore(levels, p, vec4(to_level(clamp(linear, 0.0, 1.0)), 1.0));
}
#endif

#include "pixels.glsl"
