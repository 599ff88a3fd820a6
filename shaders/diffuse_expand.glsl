// Coefficients far from all scribbles, smooth as they are, from those of the coarser grid, linear between its cells.
// Invocations run over 2 × 2 cells.
#include "diffuse.glsl"
#include "diffuse_around.glsl"

void store(ivec3 q, vec4 value)
{
  if (inside(q.xy, size)) {
    imageStore(solution, q, value);
  }
}

void main()
{
  ivec3 p = ivec3(corner(size) + 2 * in_fours(), gl_GlobalInvocationID.z);
  if (!inside(p.xy, size)) {
    return;
  }
  mat4 m = around(p);
  store(p, m[0]);
  store(p + ivec3(1, 0, 0), 0.5 * (m[0] + m[1]));
  store(p + ivec3(0, 1, 0), 0.5 * (m[0] + m[2]));
  store(p + ivec3(1, 1, 0), 0.25 * (m[0] + m[1] + m[2] + m[3]));
}
