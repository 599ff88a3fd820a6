// What the equations of a grid's values miss of a share of the right side.
#include "diffuse.glsl"
#define NEAR(x, y) imageLoad(values, ivec3(clamp(p.xy + ivec2(x, y), ivec2(0), size - 1), p.z))

void main()
{
  ivec3 p = ivec3(corner(size) + in_eights(), gl_GlobalInvocationID.z);
  if (!inside(p.xy, size)) {
    return;
  }
  // Entries of cells beyond the edge are zero.
  vec4 before = imageLoad(stencil, ivec3(p.xy, 0));
  vec4 after = imageLoad(stencil, ivec3(p.xy, 1));
  vec4 total = imageLoad(stencil, ivec3(p.xy, 2)).y * NEAR(0, 0);
  total += before.x * NEAR(-1, -1) + before.y * NEAR(0, -1) + before.z * NEAR(1, -1) + before.w * NEAR(-1, 0);
  total += after.x * NEAR(1, 0) + after.y * NEAR(-1, 1) + after.z * NEAR(0, 1) + after.w * NEAR(1, 1);
  imageStore(result, p, amount * imageLoad(right, p) - total);
}
