// Adds a frame to the running sums, or takes it away: from the layer `known` to the layer `next`; of moments, `count` of
// them, to as many of `layers`. The frame: the one that was sent, `whole` for white, with COVER weighted, with NUMBERS as
// R + 256 G + 65536 B; with MOMENT one between two that were sent (include/moment.glsl); with PLANES made of luma and
// chroma as libswscale does (core/frames/frame_source.py); with AGAIN one that the sums hold between layers `before` and
// `after`.
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
#    if MOMENT == 2 || MOMENT == 3
layout(rgba16) uniform readonly image2DArray vectors;
uniform ivec2 keys;
#    endif
// Of moments: the first one's number, of how many; key moments; the layer of the first frame. The tiles are those of a
// level, listed from `listed.x` to `listed.y`, 256 to a row, each as x + 4096 y. MOMENT, which saves lookups: 1, they are
// mixes of the two frames; 2, the first one lies behind the first frame, 3, behind key moment `keys.x` of the level.
// The last one lies before key moment `keys.y`, or at it.
uniform sampler2DArray tiles;
uniform ivec4 moment;
uniform ivec2 listed;
uniform int count, layers, level;
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
#elif !AGAIN && !MOMENT
vec3 color_at(ivec2 pixel) {
  vec4 sent = texelFetch(frame, ivec3(pixel, 0), 0);
#  if NUMBERS
  uint bytes = uint(sent.r);
  return vec3(uvec3(bytes, bytes >> 8, bytes >> 16) & 255u) / 255.0;
#  else
  return sent.rgb;
#  endif
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

#if MOMENT
// What the moments of an invocation have in common.
ivec2 pixel;
ivec3 place;
SUM sum;
vec3 before;

// Adds the moments from the key moment before `key`, whose light is `before`, to this one.
void add_until(int key, vec3 light) {
  int start = (key - 1) * moment.y, end = min(key * moment.y >> level, moment.x + count - 1);
  for (int number = max((start >> level) + 1, moment.x); number <= end; number++) {
    float late = float((number << level) - start) / float(moment.y);
    vec3 color = before * (1.0 - late) + light * late;  // exactly, of key moments
#  if DECODE == 0
    color = to_level(color);
#  endif
    sum = added(sum, light_of(color, pixel));
    int layer = next + number - moment.x;
    store(place, layer < layers ? layer : layer - layers, sum);
  }
  before = light;
}

void main() {
  int number = listed.x + int(gl_WorkGroupID.y * 256u + gl_WorkGroupID.x);
  int tile = int(texelFetch(tiles, ivec3(number & 255, number >> 8, 0), 0).r);
  ivec2 shown = ivec2(tile & 4095, tile >> 12) * ivec2(8, 16) + ivec2(gl_LocalInvocationID.xy);
  pixel = shown - ivec2(0, top);
  if (number >= listed.y || any(greaterThanEqual(pixel, size))) {
    return;
  }
  place = place_of_sums(pixel);
  sum = sum_at(place, known);
#  if MOMENT == 3
  before = key_light(shown, keys.x * moment.z >> level);
#  else
  before = frame_light(shown, moment.w);
#  endif
#  if MOMENT == 2 || MOMENT == 3
  for (int key = keys.x + 1; key <= keys.y && key < 1 << level; ++key) {
    add_until(key, key_light(shown, key * moment.z >> level));
  }
#  endif
  add_until(1 << level, frame_light(shown, 1 - moment.w));
}
#else
void at(ivec3 p) {
  ivec2 pixel = p.xy;
  ivec3 place = place_of_sums(pixel);
#  if AGAIN
  SUM light = minus(sum_at(place, after), sum_at(place, before));
#  else
  SUM light = light_of(decoded(color_at(pixel + ivec2(0, top))), pixel);
#  endif
  store(place, next, added(sum_at(place, known), light));
}
#  include "pixels.glsl"
#endif
