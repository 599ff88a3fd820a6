// Lays layers over what lies behind them, as core/pixels/layering.py does. All pictures are rgba32f, bottom row first.
#ifdef LEAST
// The lowest alpha in a block of 16 × 16 pixels: how much of what lies behind was exposed.
layout(r32f) uniform writeonly image2DArray least;
layout(rgba32f) uniform readonly image2DArray clear;  // texelFetch is slower on a software renderer
uniform ivec2 size, whole;  // in blocks, and in pixels

void at(ivec3 block) {
  float lowest = 1.0;
  for (int y = 16 * block.y; y < min(16 * block.y + 16, whole.y); y++) {
    for (int x = 16 * block.x; x < min(16 * block.x + 16, whole.x); x++) {
      lowest = min(lowest, imageLoad(clear, ivec3(x, y, 0)).a);
    }
  }
  imageStore(least, block, vec4(lowest));
}
#else
// under: the picture so far. With BEGINS it is Σ qₖ hₖ Vₖ, and the alpha of `clear` is Σ qₖ hₖ.
// exposed: a layer's F; its A is the alpha of `share`. OPAQUE: the alphas of `under` and `exposed` are these shares.
// PLAIN: the picture without layers, which stays where there is none. PLATE: what lies behind. ENDS: the last layer.
layout(rgba32f) uniform readonly image2DArray under, exposed;
#if OPAQUE
#  define COVERED own.a
#  define SEEN light.a
#else
uniform sampler2DArray share;
#  define COVERED texelFetch(share, p, 0).a
#  define SEEN texelFetch(clear, p, 0).a
#  if BEGINS
uniform sampler2DArray clear;
#  endif
#endif
#if PLAIN
uniform sampler2DArray plain;
#endif
#if PLATE
uniform sampler2DArray plate;
#endif
#include "light.glsl"
uniform ivec2 size;
#if ENDS
#  include "finish.glsl"
#else
layout(rgba32f) uniform writeonly image2DArray picture;
#endif

const float CLEAR = 1.0 / 16.0;  // the least of Σ qₖ hₖ that needs no plate
const float UNCOVERED = 1.0 - 2e-5;  // from here on no layer was in the way, up to rounding

void at(ivec3 p) {
  vec4 light = imageLoad(under, p);
  vec4 own = imageLoad(exposed, p);
#if BEGINS
  float seen = SEEN;
#  if PLATE
  float lacking = max(CLEAR - seen, 0.0);
  light = (light + lacking * texelFetch(plate, p, 0)) / max(seen, CLEAR);
#  else
  light /= max(seen, 1e-6);
#  endif
#  if PLAIN
  if (seen > UNCOVERED) {
    light = texelFetch(plain, p, 0);
  }
#  endif
#endif
  light = own + (1.0 - COVERED) * light;
#if ENDS
  finish(ivec2(p.x, size.y - 1 - p.y), light);
#else
  imageStore(picture, p, light);
#endif
}
#endif
#include "pixels.glsl"
