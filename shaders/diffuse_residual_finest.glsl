// What the red pixels miss, scaled for the coarser grid; after half a sweep over the black ones those miss nothing.
#include "diffuse.glsl"
#include "diffuse_finest.glsl"

void main()
{
  ivec3 p = ivec3(gl_GlobalInvocationID);
  p.x = 2 * p.x + (p.y & 1);
  if (!inside(p.xy, size)) {
    return;
  }
  vec4 own = texelFetch(solution, p, 0);
  vec4 total = vec4(0.0);
  for (int k = 0; k < 4; k++) {
    ivec2 j = p.xy + CROSS[k];
    if (inside(j, size)) {
      total += texelFetch(solution, ivec3(j, p.z), 0) - own;
    }
  }
  imageStore(residual, p, total * scale(p.xy));
}
