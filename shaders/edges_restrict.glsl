// From the pixels to the first coarser grid.
#include "diffuse.glsl"

vec4 near[25];

vec4 missing(ivec3 i, int at)
{
  // By differences: a diagonal that is rounded would leak like a ground.
  vec4 tied = imageLoad(links, ivec3(i.xy, 0));
  vec4 self = near[at];
  return tied.x * (near[at - 5] - self) + tied.y * (near[at - 1] - self) + tied.z * (near[at + 1] - self) +
         tied.w * (near[at + 5] - self);
}

#include "diffuse_restrict.glsl"
