// Adds the correction to the black pixels; the sweep that follows replaces the red ones.
#include "diffuse.glsl"
#include "diffuse_finest.glsl"
#include "diffuse_prolong.glsl"

void main()
{
  ivec3 p = ivec3(gl_GlobalInvocationID);
  p.x = 2 * p.x + ((p.y + 1) & 1);
  if (inside(p.xy, size)) {
    imageStore(solution, p, imageLoad(solution, p) + prolonged(p));
  }
}
