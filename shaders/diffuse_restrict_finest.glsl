// From the pixels to the first coarser grid.
#include "diffuse.glsl"

vec4 near[25];

vec4 missing(ivec3 i, int at)
{
  // Beyond the frame's edge `near` repeats the pixel itself.
  return near[at - 5] + near[at - 1] + near[at + 1] + near[at + 5] - 4.0 * near[at];
}

#include "diffuse_restrict.glsl"
