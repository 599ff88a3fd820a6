// Adds a share of coefficients to a sum of them, four shutters of a pixel.
#include "inside.glsl"

void main()
{
  ivec3 p = ivec3(gl_GlobalInvocationID);
  if (!inside(p.xy, size)) {
    return;
  }
  // Coefficients of the whole picture have one texel.
  vec4 sum = share * imageLoad(added, ivec3(min(p.xy, given - 1), p.z));
#if !BEGINS
  sum += imageLoad(mixed, p);
#endif
  imageStore(mixed, p, sum);
}
