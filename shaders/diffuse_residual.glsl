// What a coarser grid's equations miss, scaled for the next grid.
#include "diffuse.glsl"
#include "diffuse_stencil.glsl"
#define LOAD(p) texelFetch(solution, p, 0)

void main()
{
  ivec3 p = ivec3(gl_GlobalInvocationID);
  if (!inside(p.xy, size)) {
    return;
  }
  vec4 before = texelFetch(stencil, ivec3(p.xy, 0), 0);
  vec4 after = texelFetch(stencil, ivec3(p.xy, 1), 0);
  vec4 own = texelFetch(stencil, ivec3(p.xy, 2), 0);
  vec4 total = texelFetch(right, p, 0) - own.z * LOAD(p) - AROUND(before, after);
  imageStore(residual, p, total * own.y);
}
