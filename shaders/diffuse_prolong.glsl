// Adds what a grid's cells take of the coarser grid, or takes it away. Invocations run over 2 × 2 cells.
#include "diffuse.glsl"

void main()
{
  ivec3 p = ivec3(corner(size) + 2 * in_fours(), gl_GlobalInvocationID.z);
  if (!inside(p.xy, size)) {
    return;
  }
  ivec2 a = p.xy / 2;
  ivec2 b = min(a + 1, coarse - 1);
  mat4 around = amount * mat4(imageLoad(coarser, ivec3(a, p.z)), imageLoad(coarser, ivec3(b.x, a.y, p.z)),
                            imageLoad(coarser, ivec3(a.x, b.y, p.z)), imageLoad(coarser, ivec3(b, p.z)));
  for (int k = 0; k < 4; k++) {
    ivec3 q = p + ivec3(k % 2, k / 2, 0);
    if (inside(q.xy, size)) {
      imageStore(to, q, imageLoad(from, q) + around * imageLoad(weights, ivec3(q.xy, 0)));
    }
  }
}
