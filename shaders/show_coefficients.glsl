// The shutters' colours in shares of a pixel's coefficients.
// coefficients: top row first, four shutters per layer, `block` pixels of `size` along each side of a texel.
#include "show.glsl"

void main()
{
  ivec2 pixel = ivec2(vec2(at.x, 1.0 - at.y) * vec2(size));
  vec3 mix_of_colors = vec3(0.0);
  float sum = 0.0;
  for (int i = 0; i < count; i++) {
    float share = max(texelFetch(coefficients, ivec3(pixel / block, i / 4), 0)[i % 4], 0.0);
    mix_of_colors += share * texelFetch(palette, ivec3(i, 0, 0), 0).rgb;
    sum += share;
  }
  shown = on_region(vec4(mix_of_colors / max(sum, 1e-6), 1.0) * opacity);
}
