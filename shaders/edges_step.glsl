// A step of conjugate gradients: the solution and the residual. sums: residual · guess, and direction · answer with the
// answer's sign changed, as edges_missing gives it.
#include "diffuse.glsl"

void main()
{
  ivec3 p = ivec3(corner(size) + in_eights(), gl_GlobalInvocationID.z);
  if (!inside(p.xy, size)) {
    return;
  }
  vec4 power = texelFetch(sums, ivec3(0, 0, p.z), 0);
  vec4 answer = texelFetch(sums, ivec3(2, 0, p.z), 0);
  vec4 way = vec4(lessThan(answer, vec4(0.0))) * power / max(-answer, vec4(1e-37));
  imageStore(solution, p, imageLoad(solution, p) + way * imageLoad(values, p));
  imageStore(result, p, imageLoad(result, p) + way * imageLoad(right, p));
}
