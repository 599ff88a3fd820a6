// Lays COUNT mattes over coefficients, four shutters of a pixel: core/model/mattes.py's `blended`.
layout(rgba32f) uniform readonly image2DArray under;
layout(r32f) uniform readonly image2DArray values;  // a matte in each layer
layout(rgba32f) uniform image2DArray over;
layout(std140) uniform table_block { vec4 table[MOST]; };  // of each matte: its shutter, whether it adds, its opacity
uniform ivec2 size, beneath;

void at(ivec3 p) {
  // Coefficients of the whole picture have one texel.
  ivec2 own = min(p.xy, beneath - 1);
  vec4 c = imageLoad(under, ivec3(own, p.z));
  ivec4 shutters = 4 * p.z + ivec4(0, 1, 2, 3);
#if ADDS
  float rest = imageLoad(under, ivec3(own, 0)).x;  // what the default shutter has
#endif
  for (int k = 0; k < COUNT; k++) {
    int shutter = int(table[k].x);
    float share = imageLoad(values, ivec3(p.xy, k)).x * table[k].z;
#if ADDS
    float added = table[k].y * min(share, rest);
    float laid = (1.0 - table[k].y) * share;
    share = added + laid;
    rest = (rest - added) * (1.0 - laid) + (shutter == 0 ? share : 0.0);
    c = (c - added * vec4(equal(shutters, ivec4(0)))) * (1.0 - laid);
#else
    c *= 1.0 - share;
#endif
    c += share * vec4(equal(shutters, ivec4(shutter)));
  }
  // A matte's frame is mostly like the one before, and on a software renderer storing is what takes time.
  if (any(notEqual(c, imageLoad(over, p)))) {
    imageStore(over, p, c);
  }
}

#include "pixels.glsl"
