// What compute/diffusion_gpu.py begins with, what goes from a coarser grid to the finer one, and coefficients.
#include "tiles.glsl"

#ifdef START
// Fixed pixels get their shutter; free ones nothing, or what they had.
layout(r32ui) uniform readonly uimage2DArray labels;
layout(rgba32f) uniform writeonly image2DArray solution, own;
uniform int warm;

void at(ivec3 p) {
  int label = int(imageLoad(labels, ivec3(p.xy, 0)).r);
  vec4 value = vec4(equal(ivec4(label - 1 - 4 * p.z), ivec4(0, 1, 2, 3)));
  imageStore(own, p, value);
  if (label > 0 || warm == 0) {
    imageStore(solution, p, value);
  }
}

#elif defined(CLEAR)
// A coarser grid starts from nothing, or from what the finer one has.
layout(rgba32f) uniform readonly image2DArray finer;
layout(rgba32f) uniform writeonly image2DArray solution, own, right;
uniform int warm;

void at(ivec3 p) {
  imageStore(solution, p, warm == 0 ? vec4(0.0) : imageLoad(finer, ivec3(2 * p.xy, p.z)));
  imageStore(own, p, vec4(0.0));
  imageStore(right, p, vec4(0.0));
}

#elif defined(PROLONG) || defined(EXPAND) || defined(EXPAND_RIM)
layout(rgba32f) uniform readonly image2DArray coarser;
uniform ivec2 coarse;  // the coarser grid's size

// Its four cells around the 2 × 2 cells from p on, row by row. Invocations run over such.
mat4 around(ivec3 p) {
  ivec2 a = p.xy / 2;
  ivec2 b = min(a + 1, coarse - 1);
  return mat4(imageLoad(coarser, ivec3(a, p.z)), imageLoad(coarser, ivec3(b.x, a.y, p.z)),
              imageLoad(coarser, ivec3(a.x, b.y, p.z)), imageLoad(coarser, ivec3(b, p.z)));
}
#endif

#ifdef PROLONG
// Adds what a grid's cells take of the coarser grid, or takes it away.
#  if IN_PLACE
layout(rgba32f) uniform readonly image2DArray weights;
layout(rgba32f) uniform image2DArray to;
#    define from to
#  else
layout(rgba32f) uniform readonly image2DArray weights, from;
layout(rgba32f) uniform writeonly image2DArray to;
#  endif
uniform float amount;

void at(ivec3 p) {
  mat4 cells = amount * around(p);
  for (int k = 0; k < 4; k++) {
    ivec3 q = p + ivec3(k % 2, k / 2, 0);
    if (inside(q.xy, size)) {
      imageStore(to, q, imageLoad(from, q) + cells * imageLoad(weights, ivec3(q.xy, 0)));
    }
  }
}

#elif defined(EXPAND) || defined(EXPAND_RIM)
layout(rgba32f) uniform writeonly image2DArray solution;

void store(ivec3 p, mat4 cells) {
  for (int k = 0; k < 4; k++) {
    ivec3 q = p + ivec3(k % 2, k / 2, 0);
    if (inside(q.xy, size)) {
      imageStore(solution, q, cells[k]);
    }
  }
}
#endif

#ifdef EXPAND
// Coefficients far from all scribbles, smooth as they are, linear between the coarser grid's cells.
void at(ivec3 p) {
  mat4 m = around(p);
  store(p, mat4(m[0], 0.5 * (m[0] + m[1]), 0.5 * (m[0] + m[2]), 0.25 * (m[0] + m[1] + m[2] + m[3])));
}

#elif defined(EXPAND_RIM)
// The same at the frame's last columns and rows: beyond the coarser grid's last cells a parabola, level at the edge.
uniform int layers;
uniform vec2 beyond;

mat4 values(ivec2 a, ivec2 b, vec2 bend, int layer) {
  vec4 value = imageLoad(coarser, ivec3(a, layer));
  vec4 beside = mix(value, imageLoad(coarser, ivec3(b.x, a.y, layer)), bend.x);
  vec4 below = imageLoad(coarser, ivec3(a.x, b.y, layer));
  vec4 across = mix(below, imageLoad(coarser, ivec3(b, layer)), bend.x);
  return mat4(value, beside, mix(value, below, bend.y), mix(beside, across, bend.y));
}

void at(ivec3 p) {
  ivec2 a = p.xy / 2;
  vec2 ends = vec2(equal(a, coarse - 1));
  ivec2 b = max(a + 1 - 2 * ivec2(ends), 0);
  vec2 bend = mix(vec2(0.5), beyond, ends);
  vec4 least = vec4(0.0);
  for (int layer = 0; layer < layers; layer++) {
    mat4 m = values(a, b, bend, layer);
    least = min(least, min(min(m[0], m[1]), min(m[2], m[3])));
  }
  // No shutter gets less than nothing, and all of them together one.
  bend = any(lessThan(least, vec4(0.0))) ? mix(bend, vec2(0.0), ends) : bend;
  for (int layer = 0; layer < layers; layer++) {
    store(ivec3(p.xy, layer), values(a, b, bend, layer));
  }
}

#elif defined(FINISH)
// Coefficients of sum 1; shares that stand for nothing are dropped, so that an enclosed region gets one shutter alone.
layout(rgba32f) uniform image2DArray solution;
uniform int layers;
uniform float nothing;

vec4 kept(ivec3 p) {
  vec4 value = imageLoad(solution, p);
  return value * vec4(greaterThanEqual(value, vec4(nothing)));
}

void at(ivec3 p) {
  float sum = 0.0;
  for (int layer = 0; layer < layers; layer++) {
    sum += dot(kept(ivec3(p.xy, layer)), vec4(1.0));
  }
  for (int layer = 0; layer < layers; layer++) {
    vec4 first_one = vec4(layer == 0 ? 1.0 : 0.0, 0.0, 0.0, 0.0);
    imageStore(solution, ivec3(p.xy, layer), sum > 0.0 ? kept(ivec3(p.xy, layer)) / sum : first_one);
  }
}
#endif

#if defined(PROLONG) || defined(EXPAND) || defined(EXPAND_RIM)
#  define PLACE 2 * IN_FOURS
#else
#  define PLACE IN_EIGHTS
#endif
#include "cells.glsl"
