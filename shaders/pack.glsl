// Packs a frame for exposures that follow something. Each texel has two pixels, one below the other, as whole numbers. A
// rim repeats the frame's edges: two pixels before, three behind.
uniform sampler2DArray frame;
layout(rgba16ui) uniform writeonly uimage2DArray packed_frames;
uniform ivec2 size, last;  // the stored size; the frame's last pixel
uniform int layer;
#include "light.glsl"
#include "packed.glsl"

uint packed_at(ivec2 pixel) {
  vec3 color = texelFetch(frame, ivec3(clamp(pixel, ivec2(0), last), 0), 0).rgb;
  return packed_color(decoded(color));
}

void at(ivec3 p) {
  ivec2 place = p.xy - BEFORE;
  uvec2 words = uvec2(packed_at(place), packed_at(place + ivec2(0, 1)));
  imageStore(packed_frames, ivec3(p.xy, layer), halves_of(words));
}
#include "pixels.glsl"
