// A frame as exposures that follow something read it: a whole number a pixel, with that of the pixel below beside it, and
// a rim of two pixels before and three behind that repeat the frame's edges. Linear light is kept as its square root, so
// that dark steps are small; encoded light as it is.
uniform sampler2DArray frame;
layout(rgba16ui) uniform writeonly uimage2DArray packed_frames;
uniform ivec2 size;
uniform int layer;
#include "light.glsl"
#include "packed.glsl"

uint packed_at(ivec2 pixel) {
  vec3 color = texelFetch(frame, ivec3(clamp(pixel, ivec2(0), size - 1), 0), 0).rgb;
  return packed_color(decoded(color));
}

void main() {
  ivec2 place = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(place, size + RIM))) {
    return;
  }
  place -= BEFORE;
  imageStore(packed_frames, ivec3(place + BEFORE, layer),
             halves_of(uvec2(packed_at(place), packed_at(place + ivec2(0, 1)))));
}
