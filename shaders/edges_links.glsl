// What ties every free pixel to its neighbours: above, left, right, below. Fixed pixels have no equation, and get zeros.
// Invocations run over the pixels of tiles.
#include "diffuse.glsl"

float resistance_of(ivec2 cell)
{
  return imageLoad(resistances, ivec3(clamp(cell, ivec2(0), guided - 1), 0)).r;
}

// Of a pixel: linear between the middles of cells.
float resistance(ivec2 p)
{
  if (side == 1) {
    return resistance_of(p);
  }
  vec2 place = (vec2(p) + 0.5) / float(side) - 0.5;
  ivec2 a = ivec2(floor(place));
  vec2 share = place - vec2(a);
  float above = mix(resistance_of(a), resistance_of(a + ivec2(1, 0)), share.x);
  float below = mix(resistance_of(a + ivec2(0, 1)), resistance_of(a + 1), share.x);
  return mix(above, below, share.y);
}

void main()
{
  ivec2 p = corner(size) + in_eights();
  if (!inside(p, size)) {
    return;
  }
  vec4 tied = vec4(0.0);
  if (imageLoad(labels, ivec3(p, 0)).r == 0u) {
    float own_one = resistance(p);
    for (int k = 1; k < 9; k += 2) {
      ivec2 j = p + OFFSET(k);
      if (inside(j, size)) {
        tied[k / 2] = 2.0 / (own_one + resistance(j));
      }
    }
  }
  imageStore(links, ivec3(p, 0), tied);
}
