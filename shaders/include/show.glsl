#include "light.glsl"

// Premultiplied code values as the region takes them: what is drawn over a preview, Blender shows with a gamma of 2.2.
vec4 on_region(vec4 color)
{
  return srgbTarget ? vec4(pow(max(straight(color), 0.0), vec3(2.2)) * color.a, color.a) : color;
}
