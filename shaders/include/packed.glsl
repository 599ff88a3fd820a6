// Packs light into 32 bits: 11 for red, 11 for green, 10 for blue. SQUARED: linear light, by its square root, so that dark
// steps are small; else encoded light, with every 8-bit level exact.
#include "halves.glsl"

const int BEFORE = 2;

#if SQUARED
const vec3 PACKED_WHITE = vec3(2047.0, 2047.0, 1023.0);
const vec3 PACKED_UNIT = 1.0 / (PACKED_WHITE * PACKED_WHITE);
#else
const vec3 PACKED_WHITE = vec3(2040.0, 2040.0, 1020.0);
const vec3 PACKED_UNIT = 1.0 / PACKED_WHITE;
#endif

uint packed_color(vec3 light) {
#if SQUARED
  light = sqrt(max(light, 0.0));
#endif
  uvec3 whole = uvec3(ivec3(light * PACKED_WHITE + 0.5));
  return whole.r | (whole.g << 11) | (whole.b << 22);
}

// In units of PACKED_UNIT.
vec3 unpacked_color(uint color) {
  vec3 light = vec3(ivec3(color & 2047u, (color >> 11) & 2047u, color >> 22));
#if SQUARED
  return light * light;
#else
  return light;
#endif
}
