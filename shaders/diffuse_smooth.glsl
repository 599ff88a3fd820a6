// A quarter of a Gauss-Seidel sweep on a coarser grid. Invocations run over the cells of one of four colours.
#include "diffuse.glsl"
#define NEAR(x, y) imageLoad(solution, ivec3(clamp(p.xy + ivec2(x, y), ivec2(0), size - 1), p.z))
#include "diffuse_stencil.glsl"

void main()
{
  ivec3 p = ivec3(corner(size) + 2 * in_fours() + colour, gl_GlobalInvocationID.z);
  if (!inside(p.xy, size)) {
    return;
  }
  imageStore(solution, p, (imageLoad(right, p) - taken_around(p)) * imageLoad(stencil, ivec3(p.xy, 2)).x);
}
