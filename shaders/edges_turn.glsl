// The next direction of conjugate gradients. sums: residual · guess of this iteration and of the last.
#include "diffuse.glsl"

void main()
{
  ivec3 p = ivec3(corner(size) + in_eights(), gl_GlobalInvocationID.z);
  if (!inside(p.xy, size)) {
    return;
  }
  vec4 now = imageLoad(sums, ivec3(0, 0, p.z));
  vec4 before = imageLoad(sums, ivec3(1, 0, p.z));
  vec4 turned = imageLoad(values, p);
  if (fresh == 0) {
    vec4 goes_on = vec4(greaterThan(before, vec4(0.0)));
    turned += goes_on * now / max(before, vec4(1e-37)) * imageLoad(result, p);
  }
  imageStore(result, p, turned);
}
