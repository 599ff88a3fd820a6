// Adds what a grid's cells take of the coarser grid to their values. Invocations run over 2 × 2 cells.
#include "diffuse.glsl"
#include "diffuse_around.glsl"

void main()
{
  ivec3 p = ivec3(corner(size) + 2 * in_fours(), gl_GlobalInvocationID.z);
  if (!inside(p.xy, size)) {
    return;
  }
  mat4 cells = around(p);
  for (int k = 0; k < 4; k++) {
    ivec3 q = p + ivec3(k % 2, k / 2, 0);
    if (inside(q.xy, size)) {
      imageStore(solution, q, imageLoad(solution, q) + cells * imageLoad(weights, ivec3(q.xy, 0)));
    }
  }
}
