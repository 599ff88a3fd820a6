#include "light.glsl"

// Premultiplied code values as the region takes them: an sRGB framebuffer encodes light by itself.
vec4 on_region(vec4 color)
{
  return srgbTarget ? vec4(to_linear_exact(straight(color)) * color.a, color.a) : color;
}
