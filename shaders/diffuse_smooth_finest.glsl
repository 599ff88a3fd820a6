// Half a red-black Gauss-Seidel sweep at full size. Invocations run over the pixels of one colour.
#include "diffuse.glsl"

void main()
{
  ivec3 p = ivec3(corner(size) + in_fours() * ivec2(2, 1), gl_GlobalInvocationID.z);
  p.x += (p.y + colour) & 1;
  if (!inside(p.xy, size) || imageLoad(labels, ivec3(p.xy, 0)).r > 0u) {
    return;
  }
  // Beyond the frame's edge there is nothing: weight 0.
  vec4 total = vec4(0.0);
  float count = 0.0;
  for (int k = 1; k < 9; k += 2) {
    ivec2 j = p.xy + OFFSET(k);
    if (inside(j, size)) {
      total += imageLoad(solution, ivec3(j, p.z));
      count += 1.0;
    }
  }
  imageStore(solution, p, total / max(count, 1.0));
}
