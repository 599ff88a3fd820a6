// Layers laid over what lies behind them; core/pixels/layering.py is the reference. All pictures are rgba32f, bottom row
// first, as the passes that compose leave them.
#ifdef LEAST
// The least alpha of a block of 16 × 16 pixels: how much of what lies behind was seen.
layout(r32f) uniform writeonly image2DArray least;
layout(rgba32f) uniform readonly image2DArray clear;  // a software renderer's texelFetch takes longer
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
// BEGINS: `under` has Σ qₖ hₖ Vₖ, and `clear` in its alpha Σ qₖ hₖ; else it is a picture that a layer is laid over. PLAIN:
// the picture without layers, which stays where none is. PLATE: what lies behind. exposed, share: a layer's F, and in its
// alpha A. OPAQUE: the alphas of `under` and `exposed` are these shares. ENDS: no other layer follows.
layout(rgba32f) uniform readonly image2DArray under, exposed;
#if !OPAQUE
uniform sampler2DArray share;
#endif
#if BEGINS
#  if !OPAQUE
uniform sampler2DArray clear;
#  endif
#  if PLAIN
uniform sampler2DArray plain;
#  endif
#  if PLATE
uniform sampler2DArray plate;
#  endif
#endif
#include "light.glsl"
uniform ivec2 size;
#if ENDS
#  include "finish.glsl"
#else
layout(rgba32f) uniform writeonly image2DArray picture;
#endif

// Of Σ qₖ hₖ, what must have been seen; and from where on none of a layer was in the way, but for rounding.
const float CLEAR = 1.0 / 16.0;
const float UNCOVERED = 1.0 - 2e-5;

void at(ivec3 p) {
  vec4 light = imageLoad(under, p);
  vec4 own = imageLoad(exposed, p);
#if OPAQUE
  float covered = own.a;
#else
  float covered = texelFetch(share, p, 0).a;
#endif
#if BEGINS
#  if OPAQUE
  float seen = light.a;
#  else
  float seen = texelFetch(clear, p, 0).a;
#  endif
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
  light = own + (1.0 - covered) * light;
#if ENDS
  finish(ivec2(p.x, size.y - 1 - p.y), light);
#else
  imageStore(picture, p, light);
#endif
}
#endif
#include "pixels.glsl"
