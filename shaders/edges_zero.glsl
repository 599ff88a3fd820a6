// A grid's values before conjugate gradients ask for a guess.
#include "diffuse.glsl"

void main()
{
  ivec3 p = ivec3(corner(size) + in_eights(), gl_GlobalInvocationID.z);
  if (inside(p.xy, size)) {
    imageStore(solution, p, vec4(0.0));
  }
}
