// A composed picture in display code values (view transform Standard), premultiplied for blending.
#include "show.glsl"

void main()
{
  vec4 color = texture(picture, vec3(at, 0.0));
  color.rgb = to_encoded(clamp(straight(color), 0.0, 1.0)) * color.a;
  shown = on_region(color * opacity);
}
