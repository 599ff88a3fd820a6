// From a coarser operator to the next.
#include "diffuse.glsl"

float product[25];

void add_row(ivec2 i, int at, float weight)
{
  vec4 before = weight * imageLoad(stencil, ivec3(i, 0));
  vec4 after = weight * imageLoad(stencil, ivec3(i, 1));
  product[at - 6] += before.x;
  product[at - 5] += before.y;
  product[at - 4] += before.z;
  product[at - 1] += before.w;
  product[at] += weight * imageLoad(stencil, ivec3(i, 2)).y;
  product[at + 1] += after.x;
  product[at + 4] += after.y;
  product[at + 5] += after.z;
  product[at + 6] += after.w;
}

#include "diffuse_coarsen.glsl"
