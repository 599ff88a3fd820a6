// Steps of compute/diffusion_gpu.py: starting values, prolongation from a coarser grid, and finished coefficients.
#include "tiles.glsl"

#ifdef START
// Sets fixed pixels to their shutter, and free ones to 0, or leaves them as they were (warm).
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
// Starts a coarser grid from 0, or from the values of the finer one (warm).
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

// The four coarse cells around the 2 × 2 cells from p on, row by row. There is an invocation for each 2 × 2 cells.
mat4 around(ivec3 p) {
  ivec2 a = p.xy / 2;
  ivec2 b = min(a + 1, coarse - 1);
  return mat4(imageLoad(coarser, ivec3(a, p.z)), imageLoad(coarser, ivec3(b.x, a.y, p.z)),
              imageLoad(coarser, ivec3(a.x, b.y, p.z)), imageLoad(coarser, ivec3(b, p.z)));
}
#endif

#ifdef PROLONG
// Adds the prolongation of the coarser grid, times `amount`.
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
// Interpolates linearly between the coarser grid's cells: far from scribbles, coefficients are smooth.
void at(ivec3 p) {
  mat4 m = around(p);
  store(p, mat4(m[0], 0.5 * (m[0] + m[1]), 0.5 * (m[0] + m[2]), 0.25 * (m[0] + m[1] + m[2] + m[3])));
}

#elif defined(EXPAND_RIM)
// EXPAND at the frame's last columns and rows. Beyond the coarser grid's last cells: a parabola that is level at the edge.
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
  // Where a coefficient would be negative, nothing is extrapolated: the sum stays 1.
  bend = any(lessThan(least, vec4(0.0))) ? mix(bend, vec2(0.0), ends) : bend;
  for (int layer = 0; layer < layers; layer++) {
    store(ivec3(p.xy, layer), values(a, b, bend, layer));
  }
}

#elif defined(FINISH)
// Scales coefficients to a sum of 1. Those below `nothing` become 0, so that an enclosed region gets one shutter.
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
