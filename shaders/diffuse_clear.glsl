// A coarser grid starts from nothing, or from what the finer one has.
#include "diffuse.glsl"

void main()
{
  ivec3 p = ivec3(corner(size) + in_eights(), gl_GlobalInvocationID.z);
  if (inside(p.xy, size)) {
    imageStore(solution, p, warm == 0 ? vec4(0.0) : imageLoad(finer, ivec3(2 * p.xy, p.z)));
    imageStore(own, p, vec4(0.0));
    imageStore(right, p, vec4(0.0));
  }
}
