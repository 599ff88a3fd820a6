// From a coarser operator to the next.
#include "diffuse.glsl"
#include "diffuse_stencil.glsl"
#include "diffuse_coarsen.glsl"

void main()
{
  ivec2 p = ivec2(gl_GlobalInvocationID);
  if (!inside(p, coarse)) {
    return;
  }
  float product[25];
  for (int n = 0; n < 25; n++) {
    product[n] = 0.0;
  }
  for (int c = 0; c < 9; c++) {
    ivec2 i = 2 * p + OFFSET(c);
    if (inside(i, size)) {
      vec4 before = texelFetch(stencil, ivec3(i, 0), 0);
      vec4 after = texelFetch(stencil, ivec3(i, 1), 0);
      vec4 own = texelFetch(stencil, ivec3(i, 2), 0);
      float weight = share(i, p, coarse) * own.y;
      int at = 5 * (c / 3 + 1) + c % 3 + 1;
      for (int k = 0; k < 3; k++) {
        product[at - 6 + k] += weight * before[k];
        product[at + 4 + k] += weight * after[k + 1];
      }
      product[at - 1] += weight * before.w;
      product[at] += weight * own.z;
      product[at + 1] += weight * after.x;
    }
  }
  store_row(p, product);
}
