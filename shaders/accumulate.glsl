// Adds a frame to the running sums, or takes it away: from the layer `known` to the layer `next`.
// The frame: the one that was sent, in light that is summed (DECODE: 0 as it is, 1 made linear, 2 encoded), `whole` for white;
// or with AGAIN one that the sums hold already, between the layers `before` and `after`.
#include "light.glsl"
#include "sums.glsl"

void main()
{
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, size))) {
    return;
  }
  ivec2 place = place_of_sums(pixel);
#if AGAIN
  uvec2 light = minus(sum_at(place, after), sum_at(place, before));
#else
  vec3 color = texelFetch(frame, ivec3(pixel + ivec2(0, top), 0), 0).rgb;
#  if DECODE == 1
  color = to_linear(color);
#  elif DECODE == 2
  color = to_encoded(color);
#  endif
  uvec2 light = packed_light(uvec3(ivec3(color * whole + 0.5)));
#endif
  uvec2 sum = sum_at(place, known);
  imageStore(sums, ivec3(place, next), halves_of(BACK != 0 ? minus(sum, light) : plus(sum, light)));
}
