// A composed picture's levels, top row first.
#include "show.glsl"

void main()
{
  shown = on_region(texture(picture, vec3(at.x, 1.0 - at.y, 0.0)) * opacity);
}
