// A quarter of a Gauss-Seidel sweep on a coarser grid. Invocations run over the cells of one of four colours.
#include "diffuse.glsl"
#include "diffuse_stencil.glsl"
#define LOAD(p) imageLoad(solution, p)

void main()
{
  ivec3 p = ivec3(2 * ivec2(gl_GlobalInvocationID) + colour, gl_GlobalInvocationID.z);
  if (!inside(p.xy, size)) {
    return;
  }
  vec4 before = texelFetch(stencil, ivec3(p.xy, 0), 0);
  vec4 after = texelFetch(stencil, ivec3(p.xy, 1), 0);
  float inverse = texelFetch(stencil, ivec3(p.xy, 2), 0).x;
  imageStore(solution, p, (texelFetch(right, p, 0) - AROUND(before, after)) * inverse);
}
