// From a coarser grid to the next.
#include "diffuse.glsl"

vec4 missing(ivec3 i, inout vec4 near[25], int at)
{
  vec4 before = imageLoad(stencil, ivec3(i.xy, 0));
  vec4 after = imageLoad(stencil, ivec3(i.xy, 1));
  vec4 total = imageLoad(right, i) - before.w * near[at - 1] - after.x * near[at + 1];
  for (int k = 0; k < 3; k++) {
    total -= before[k] * near[at - 6 + k] + after[k + 1] * near[at + 4 + k];
  }
  return total - imageLoad(stencil, ivec3(i.xy, 2)).y * near[at];
}

#include "diffuse_restrict.glsl"
