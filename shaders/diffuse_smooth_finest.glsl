// Half a red-black Gauss-Seidel sweep at full size. Invocations run over the pixels of one colour.
#include "diffuse.glsl"
#include "diffuse_finest.glsl"

void main()
{
  ivec3 p = ivec3(gl_GlobalInvocationID);
  p.x = 2 * p.x + ((p.y + colour) & 1);
  if (!inside(p.xy, size) || scale(p.xy) == 0.0) {
    return;
  }
  vec4 total = vec4(0.0);
  float count = 0.0;
  for (int k = 0; k < 4; k++) {
    ivec2 j = p.xy + CROSS[k];
    if (inside(j, size)) {
      total += imageLoad(solution, ivec3(j, p.z));
      count += 1.0;
    }
  }
  imageStore(solution, p, total / max(count, 1.0));
}
