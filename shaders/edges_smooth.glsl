// Half a red-black Gauss-Seidel sweep over the pixels. Invocations run over the pixels of one colour.
#include "diffuse.glsl"
#define NEAR(x, y) imageLoad(solution, ivec3(clamp(p.xy + ivec2(x, y), ivec2(0), size - 1), p.z))

void main()
{
  ivec3 p = ivec3(corner(size) + in_fours() * ivec2(2, 1), gl_GlobalInvocationID.z);
  p.x += (p.y + colour) & 1;
  if (!inside(p.xy, size)) {
    return;
  }
  vec4 tied = imageLoad(links, ivec3(p.xy, 0));
  float diagonal = dot(tied, vec4(1.0));
  if (diagonal > 0.0) {
    vec4 total = tied.x * NEAR(0, -1) + tied.y * NEAR(-1, 0) + tied.z * NEAR(1, 0) + tied.w * NEAR(0, 1);
    imageStore(solution, p, total / diagonal);
  }
}
