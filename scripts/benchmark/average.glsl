// The plain mean of the window's LAST frames: what every composition is measured against.
layout(local_size_x = 64) in;
uniform sampler2DArray frames;
layout(rgba32f) uniform writeonly image2DArray picture;
uniform ivec2 size;
uniform int top, height, first_layer;
#include "light.glsl"

void main() {
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (pixel.x >= size.x || pixel.y >= size.y) {
    return;
  }
  vec3 total = vec3(0.0);
  for (int layer = 0; layer < LAST; layer++) {
    vec3 color = texelFetch(frames, ivec3(pixel, layer), 0).rgb;
#if DECODE
    color = to_linear(color);
#endif
    total += color;
  }
  total /= float(LAST);
#if !DECODE
  total = to_linear_exact(total);
#endif
  imageStore(picture, ivec3(pixel.x, height - 1 - top - pixel.y, 0), vec4(total, 1.0));
}
