// Running sums along time: a pixel's sum at position p is the light of all frames before p, in three fields of 21 bits.
// With COVER (of a layer, core/pixels/layering.py) there are four fields of 32 bits: weighted light, then with 1 the
// weights, with 2 one minus the weights. Only differences are used, which stay exact when sums wrap around.
#if COVER
#define SUM uvec4
#define LIGHT vec4
#define AS_STORED(sum) sum
#define AS_SUM(stored) stored

// No macros: Metal's uniforms are macros themselves.
uvec4 minus(uvec4 a, uvec4 b) {
  return a - b;
}

uvec4 plus(uvec4 a, uvec4 b) {
  return a + b;
}

vec4 unpacked_light(uvec4 difference) {
  return vec4(ivec4(difference));
}

// A layer's light in a fraction of the window, and its alpha.
vec4 covered(vec4 light) {
  return vec4(light.rgb, COVER == 2 ? 1.0 - light.a : light.a);
}
#else
#include "halves.glsl"
#define SUM uvec2
#define LIGHT vec3
#define AS_STORED(sum) halves_of(sum)
#define AS_SUM(stored) words_of(stored)

const uint FIELD = 0x1FFFFFu;

uvec2 minus(uvec2 a, uvec2 b) {
  return uvec2(a.x - b.x, a.y - b.y - (a.x < b.x ? 1u : 0u));
}

uvec2 plus(uvec2 a, uvec2 b) {
  uint low = a.x + b.x;
  return uvec2(low, a.y + b.y + (low < a.x ? 1u : 0u));
}

uvec2 packed_light(uvec3 light) {
  return uvec2(light.r | (light.g << 21), (light.g >> 11) | (light.b << 10));
}

// Signed integers convert to floats in one instruction.
vec3 unpacked_light(uvec2 difference) {
  uint green = (difference.x >> 21) | (difference.y << 11);
  return vec3(ivec3(difference.x & FIELD, green & FIELD, difference.y >> 10));
}

vec4 covered(vec3 light) {
  return vec4(light, 1.0);
}
#endif

// Where a pixel's sums begin. TILED: a row of texels holds a tile of 8 × 16 pixels, a layer holds a row of tiles; each row
// of a tile has so many layers side by side.
ivec3 place_of_sums(ivec2 pixel) {
#if TILED
  return ivec3((pixel.y & 15) * 8 * TILED + (pixel.x & 7), pixel.x >> 3, pixel.y >> 4);
#else
  return ivec3(pixel, 0);
#endif
}

ivec3 place_in_layer(ivec3 place, int layer) {
#if TILED
  return place + ivec3((layer & ~(TILED - 1)) * 128 + (layer & TILED - 1) * 8, 0, 0);
#else
  return place + ivec3(0, 0, layer);
#endif
}

// On a software renderer, texelFetch of whole numbers takes three times as long as imageLoad.
SUM sum_at(ivec3 place, int layer) {
  return AS_SUM(imageLoad(sums, place_in_layer(place, layer)));
}
