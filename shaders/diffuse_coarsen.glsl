// From a coarser operator to the next.
#include "diffuse.glsl"

void add_row(ivec2 i, int at, float weight, inout float product[25])
{
  vec4 before = imageLoad(stencil, ivec3(i, 0));
  vec4 after = imageLoad(stencil, ivec3(i, 1));
  for (int k = 0; k < 3; k++) {
    product[at - 6 + k] += weight * before[k];
    product[at + 4 + k] += weight * after[k + 1];
  }
  product[at - 1] += weight * before.w;
  product[at] += weight * imageLoad(stencil, ivec3(i, 2)).y;
  product[at + 1] += weight * after.x;
}

#include "diffuse_coarsen.glsl"
