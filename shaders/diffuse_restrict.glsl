// From a coarser grid to the next.
#include "diffuse.glsl"

vec4 near[25];

vec4 missing(ivec3 i, int at)
{
  vec4 before = imageLoad(stencil, ivec3(i.xy, 0));
  vec4 after = imageLoad(stencil, ivec3(i.xy, 1));
  vec4 total = texelFetch(right, i, 0) - imageLoad(stencil, ivec3(i.xy, 2)).y * near[at];
  total -= before.x * near[at - 6] + before.y * near[at - 5] + before.z * near[at - 4] + before.w * near[at - 1];
  total -= after.x * near[at + 1] + after.y * near[at + 4] + after.z * near[at + 5] + after.w * near[at + 6];
  return total;
}

#include "diffuse_restrict.glsl"
