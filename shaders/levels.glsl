// A picture as the levels of an 8-bit file, top row first: display code values (view transform Standard) over black.
layout(local_size_x = 64) in;
layout(rgba32f) uniform readonly image2DArray picture;
layout(rgba8) uniform writeonly image2DArray levels;
uniform ivec2 size;
#include "light.glsl"

void at(ivec3 p) {
  vec3 linear = imageLoad(picture, ivec3(p.x, size.y - 1 - p.y, 0)).rgb;
  imageStore(levels, p, vec4(to_level(clamp(linear, 0.0, 1.0)), 1.0));
}

#include "pixels.glsl"
