// Fixed pixels get their shutter, free ones nothing; and how far each follows the coarser grid: less where its
// neighbours are fixed, and not at all where it is fixed itself.
#include "diffuse.glsl"

void main()
{
  ivec3 p = ivec3(gl_GlobalInvocationID);
  if (!inside(p.xy, size)) {
    return;
  }
  int label = int(texelFetch(labels, ivec3(p.xy, 0), 0).r);
  imageStore(solution, p, vec4(equal(ivec4(label - 1 - 4 * p.z), ivec4(0, 1, 2, 3))));
  if (p.z > 0) {
    return;
  }
  float count = 0.0;
  float fixed_ones = 0.0;
  for (int k = 1; k < 9; k += 2) {
    ivec2 j = p.xy + OFFSET(k);
    if (inside(j, size)) {
      count += 1.0;
      fixed_ones += texelFetch(labels, ivec3(j, 0), 0).r > 0u ? 1.0 : 0.0;
    }
  }
  imageStore(following, p, vec4(label > 0 ? 0.0 : 1.0 - hold * fixed_ones / max(count, 1.0)));
}
