// A picture as the levels of an 8-bit file, top row first: display code values (view transform Standard) over black.
#include "light.glsl"

void main()
{
  ivec2 p = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(p, size))) {
    return;
  }
  vec3 linear = imageLoad(picture, ivec3(p.x, size.y - 1 - p.y, 0)).rgb;
  imageStore(levels, ivec3(p, 0), vec4(to_level(clamp(linear, 0.0, 1.0)), 1.0));
}
