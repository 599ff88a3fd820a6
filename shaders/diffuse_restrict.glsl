// The residual of a grid becomes the right side of the next one, whose correction starts from nothing.
#include "diffuse.glsl"

void main()
{
  ivec3 p = ivec3(gl_GlobalInvocationID);
  if (!inside(p.xy, coarse)) {
    return;
  }
  vec4 total = vec4(0.0);
  for (int k = 0; k < 9; k += step) {
    ivec2 i = 2 * p.xy + OFFSET(k);
    if (inside(i, size)) {
      total += share(i, p.xy, coarse) * texelFetch(residual, ivec3(i, p.z), 0);
    }
  }
  imageStore(right, p, total);
  imageStore(correction, p, vec4(0.0));
}
