// Fixed pixels get their shutter; free ones nothing, or what they had.
#include "diffuse.glsl"

void main()
{
  ivec3 p = ivec3(corner(size) + in_eights(), gl_GlobalInvocationID.z);
  if (!inside(p.xy, size)) {
    return;
  }
  int label = int(imageLoad(labels, ivec3(p.xy, 0)).r);
  vec4 value = vec4(equal(ivec4(label - 1 - 4 * p.z), ivec4(0, 1, 2, 3)));
  imageStore(own, p, value);
  if (label > 0 || warm == 0) {
    imageStore(solution, p, value);
  }
}
