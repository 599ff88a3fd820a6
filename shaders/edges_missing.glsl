// What the equations of a grid's values miss of a share of the right side.
#include "diffuse.glsl"
#define NEAR(x, y) imageLoad(values, ivec3(clamp(p.xy + ivec2(x, y), ivec2(0), size - 1), p.z))
#include "diffuse_stencil.glsl"

void main()
{
  ivec3 p = ivec3(corner(size) + in_eights(), gl_GlobalInvocationID.z);
  if (!inside(p.xy, size)) {
    return;
  }
  vec4 total = imageLoad(stencil, ivec3(p.xy, 2)).y * NEAR(0, 0) + taken_around(p);
  imageStore(result, p, amount * imageLoad(right, p) - total);
}
