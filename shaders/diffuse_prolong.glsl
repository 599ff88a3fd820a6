// Adds the correction of the coarser grid.
#include "diffuse.glsl"
#include "diffuse_stencil.glsl"
#include "diffuse_prolong.glsl"

void main()
{
  ivec3 p = ivec3(gl_GlobalInvocationID);
  if (inside(p.xy, size)) {
    imageStore(solution, p, imageLoad(solution, p) + prolonged(p));
  }
}
