// Zeros in all cells of a grid.
#include "inside.glsl"

void main()
{
  ivec3 p = ivec3(gl_GlobalInvocationID);
  if (inside(p.xy, size)) {
    imageStore(values, p, vec4(0.0));
  }
}
