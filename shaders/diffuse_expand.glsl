// Coefficients far from all scribbles, smooth as they are, from those of the coarser grid, linear between its cells.
// Invocations run over 2 × 2 cells.
#include "diffuse.glsl"

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
  ivec2 a = p.xy / 2;
  ivec2 b = min(a + 1, coarse - 1);
  vec4 value = imageLoad(coarser, ivec3(a, p.z));
  vec4 beside = imageLoad(coarser, ivec3(b.x, a.y, p.z));
  vec4 below = imageLoad(coarser, ivec3(a.x, b.y, p.z));
  vec4 across = imageLoad(coarser, ivec3(b, p.z));
  store(p, value);
  store(p + ivec3(1, 0, 0), 0.5 * (value + beside));
  store(p + ivec3(0, 1, 0), 0.5 * (value + below));
  store(p + ivec3(1, 1, 0), 0.25 * (value + beside + below + across));
}
