// Adds a frame to the running sums, or takes it away: from the layer `known` to the layer `next`; of moments, `count` of
// them, to as many of `layers`. The frame: the one that was sent, `whole` for white, with COVER weighted, with NUMBERS as
// R + 256 G + 65536 B; with MOMENT one between two that were sent (include/moment.glsl); with PLANES made of luma and
// chroma as libswscale does (core/frames/planes.py); with AGAIN one that the sums hold between layers `before` and `after`.
layout(local_size_x = 8, local_size_y = 16) in;  // a tile
layout(STORED) uniform uimage2DArray sums;
uniform ivec2 size;
uniform int known, next;
#if AGAIN
uniform int before, after;
#else
uniform int top;
uniform float whole;
#  if COVER
uniform sampler2DArray weights;
#  endif
#  if PLANES
layout(r32ui) uniform readonly uimage2DArray luma, chroma;  // a software renderer's texelFetch takes longer
uniform ivec2 chroma_step, luma_of, green_of;
uniform int red_of, blue_of;
#  elif MOMENT
layout(r32ui) uniform readonly uimage2DArray filmed;  // images: see `luma`
layout(rgba16) uniform readonly image2DArray vectors;
uniform ivec4 moment;
uniform int count, layers;
#  else
uniform sampler2DArray frame;
#  endif
#endif
#include "light.glsl"
#include "sums.glsl"
#if MOMENT
#  include "moment.glsl"
#endif

#if PLANES
// A texel has four samples, side by side.
int sample_of(uvec4 texel, int x) {
  return int((texel.r >> ((x & 3) << 3)) & 255u);
}

// Sums wrap around beyond 32 bits, as libswscale's do.
vec3 color_at(ivec2 pixel) {
  ivec2 place = (pixel * chroma_step + (chroma_step >> 1)) >> 16;
  int light = ((sample_of(imageLoad(luma, ivec3(pixel.x >> 2, pixel.y, 0)), pixel.x) << 9) - luma_of.x) * luma_of.y + (1 << 21);
  int cb = (sample_of(imageLoad(chroma, ivec3(place.x >> 2, place.y, 0)), place.x) - 128) << 9;
  int cr = (sample_of(imageLoad(chroma, ivec3(place.x >> 2, place.y, 1)), place.x) - 128) << 9;
  ivec3 rgb = light + ivec3(cr * red_of, cb * green_of.x + cr * green_of.y, cb * blue_of);
  return vec3(clamp(rgb, 0, (1 << 30) - 1) >> 22) / 255.0;
}
#endif

SUM added(SUM sum, SUM light) {
  return BACK != 0 ? minus(sum, light) : plus(sum, light);
}

void store(ivec3 place, int layer, SUM sum) {
  imageStore(sums, place_in_layer(place, layer), AS_STORED(sum));
}

#if !AGAIN
SUM light_of(vec3 color, ivec2 pixel) {
#  if COVER
  float weight = texelFetch(weights, ivec3(pixel + ivec2(0, top), 0), 0).r;
  vec4 weighted = vec4(color * weight, COVER == 2 ? 1.0 - weight : weight);
  return uvec4(ivec4(weighted * whole + 0.5));
#  else
  return packed_light(uvec3(ivec3(color * whole + 0.5)));
#  endif
}
#endif

void at(ivec3 p) {
  ivec2 pixel = p.xy;
  ivec3 place = place_of_sums(pixel);
  SUM sum = sum_at(place, known);
#if MOMENT
  for (int k = 0; k < count; ++k) {
    // Rounded to levels, as the reference reads it.
    vec3 color = floor(to_level(moment_at(pixel + ivec2(0, top), k)) * 255.0 + 0.5) / 255.0;
#  if DECODE == 1
    color = to_linear(color);
#  endif
    sum = added(sum, light_of(color, pixel));
    int layer = next + k;
    store(place, layer < layers ? layer : layer - layers, sum);
  }
#elif AGAIN
  store(place, next, added(sum, minus(sum_at(place, after), sum_at(place, before))));
#else
#  if PLANES
  vec3 color = decoded(color_at(pixel + ivec2(0, top)));
#  else
  vec4 sent = texelFetch(frame, ivec3(pixel + ivec2(0, top), 0), 0);
#    if NUMBERS
  uint bytes = uint(sent.r);
  vec3 color = decoded(vec3(uvec3(bytes, bytes >> 8, bytes >> 16) & 255u) / 255.0);
#    else
  vec3 color = decoded(sent.rgb);
#    endif
#  endif
  store(place, next, added(sum, light_of(color, pixel)));
#endif
}

#include "pixels.glsl"
