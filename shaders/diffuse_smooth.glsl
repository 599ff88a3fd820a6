// A quarter of a Gauss-Seidel sweep on a coarser grid. Invocations run over the cells of one of four colours.
#include "diffuse.glsl"
#define NEAR(x, y) imageLoad(solution, ivec3(clamp(p.xy + ivec2(x, y), ivec2(0), size - 1), p.z))

void main()
{
  ivec3 p = ivec3(corner(size) + 2 * in_fours() + colour, gl_GlobalInvocationID.z);
  if (!inside(p.xy, size)) {
    return;
  }
  // Entries of cells beyond the edge are zero.
  vec4 before = imageLoad(stencil, ivec3(p.xy, 0));
  vec4 after = imageLoad(stencil, ivec3(p.xy, 1));
  vec4 total = before.x * NEAR(-1, -1) + before.y * NEAR(0, -1) + before.z * NEAR(1, -1) + before.w * NEAR(-1, 0);
  total += after.x * NEAR(1, 0) + after.y * NEAR(-1, 1) + after.z * NEAR(0, 1) + after.w * NEAR(1, 1);
  imageStore(solution, p, (imageLoad(right, p) - total) * imageLoad(stencil, ivec3(p.xy, 2)).x);
}
