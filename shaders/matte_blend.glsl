// Lays COUNT mattes over coefficients, four shutters of a pixel, as `blended` in core/model/mattes.py does.
layout(rgba32f) uniform readonly image2DArray under;
layout(r32f) uniform readonly image2DArray values;  // a matte in each layer
layout(rgba32f) uniform image2DArray over;
layout(std140) uniform table_block { vec4 table[MOST]; };  // of each matte: its shutter, whether it adds, its opacity
uniform ivec2 size, beneath;

void at(ivec3 p) {
  ivec2 own = min(p.xy, beneath - 1);  // coefficients of the whole picture have one texel
  vec4 c = imageLoad(under, ivec3(own, p.z));
  float rest = imageLoad(under, ivec3(own, 0)).x;  // the default shutter's coefficient
  ivec4 shutters = 4 * p.z + ivec4(0, 1, 2, 3);
  for (int k = 0; k < COUNT; k++) {
    int shutter = int(table[k].x);
    float share = imageLoad(values, ivec3(p.xy, k)).x * table[k].z;
    float added = table[k].y * min(share, rest);
    float laid = (1.0 - table[k].y) * share;
    share = added + laid;
    rest = (rest - added) * (1.0 - laid) + (shutter == 0 ? share : 0.0);
    c = (c - added * vec4(equal(shutters, ivec4(0)))) * (1.0 - laid) + share * vec4(equal(shutters, ivec4(shutter)));
  }
  // Most mattes change little from frame to frame, and storing is what takes time on a software renderer.
  if (any(notEqual(c, imageLoad(over, p)))) {
    imageStore(over, p, c);
  }
}
#include "pixels.glsl"
