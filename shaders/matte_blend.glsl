// Lays mattes over coefficients, four shutters of a pixel: core/mattes.py's `blended`.
#include "inside.glsl"

void main()
{
  ivec3 p = ivec3(gl_GlobalInvocationID);
  if (!inside(p.xy, size)) {
    return;
  }
  // Coefficients of the whole picture have one texel.
  ivec2 own = min(p.xy, beneath - 1);
  vec4 c = imageLoad(under, ivec3(own, p.z));
  float rest = imageLoad(under, ivec3(own, 0)).x;  // what the default shutter has
  for (int k = 0; k < count; k++) {
    int shutter = int(table[k].x);
    float share = imageLoad(values, ivec3(p.xy, k)).x * table[k].z;
    if (table[k].y > 0.0) {
      share = min(share, rest);
      rest -= share;
      if (p.z == 0) {
        c.x -= share;
      }
    }
    else {
      rest *= 1.0 - share;
      c *= 1.0 - share;
    }
    if (shutter == 0) {
      rest += share;
    }
    if (shutter / 4 == p.z) {
      c[shutter % 4] += share;
    }
  }
  imageStore(over, p, c);
}
