// Steps of compute/edge_diffusion_gpu.py besides the multigrid: the pixels' links, and conjugate gradients.
// A sum over all cells is made of `parts`, one for each invocation, in a fixed order.
#if defined(LINKS) || defined(TURN) || defined(STEP)
#  include "tiles.glsl"
#endif

#ifdef LINKS
// Makes the links of each free pixel to its neighbours: above, left, right, below. Fixed pixels get zeros.
layout(r32ui) uniform readonly uimage2DArray labels;
layout(r32f) uniform readonly image2DArray resistances;
layout(rgba32f) uniform writeonly image2DArray links;
uniform ivec2 guided;  // the size of `resistances`
uniform int side;  // of its cells, in pixels

float resistance_of(ivec2 cell) {
  return imageLoad(resistances, ivec3(clamp(cell, ivec2(0), guided - 1), 0)).r;
}

// A pixel's resistance, linear between the centres of cells.
float resistance(ivec2 p) {
  vec2 place = (vec2(p) + 0.5) / float(side) - 0.5;
  ivec2 a = ivec2(floor(place));
  vec2 share = place - vec2(a);
  float above = mix(resistance_of(a), resistance_of(a + ivec2(1, 0)), share.x);
  float below = mix(resistance_of(a + ivec2(0, 1)), resistance_of(a + 1), share.x);
  return mix(above, below, share.y);
}

void at(ivec3 p) {
  vec4 tied = vec4(0.0);
  if (imageLoad(labels, p).r == 0u) {
    float own_one = resistance(p.xy);
    for (int k = 1; k < 9; k += 2) {
      ivec2 j = p.xy + OFFSET(k);
      if (inside(j, size)) {
        tied[k / 2] = 2.0 / (own_one + resistance(j));
      }
    }
  }
  imageStore(links, p, tied);
}

#elif defined(ZERO)
// Clears all cells of a grid.
layout(rgba32f) uniform writeonly image2DArray values;
uniform ivec2 size;

void at(ivec3 p) {
  imageStore(values, p, vec4(0.0));
}
#  include "pixels.glsl"

#elif defined(DOT) || defined(CHANGE)
// DOT: parts of a sum of products. CHANGE: parts of the largest difference from `noted`, which becomes the new values.
layout(rgba32f) uniform readonly image2DArray values;
#  ifdef DOT
layout(rgba32f) uniform readonly image2DArray right;
#  else
layout(rgba32f) uniform image2DArray noted;
#  endif
layout(rgba32f) uniform writeonly image2DArray result;
uniform ivec2 size, grid;  // the number of parts, and the grid's size in cells

void at(ivec3 part) {
  vec4 total = vec4(0.0);
  for (int k = part.x; k < grid.x * grid.y; k += size.x) {
    ivec3 p = ivec3(k % grid.x, k / grid.x, part.z);
    vec4 value = imageLoad(values, p);
#  ifdef DOT
    total += value * imageLoad(right, p);
#  else
    total = max(total, abs(value - imageLoad(noted, p)));
    imageStore(noted, p, value);
#  endif
  }
  imageStore(result, part, total);
}
#  include "pixels.glsl"

#elif defined(SUM)
// Adds the parts, in one invocation.
layout(local_size_x = 1) in;
layout(rgba32f) uniform readonly image2DArray result;
layout(rgba32f) uniform image2DArray sums;
uniform int parts, place;  // place: where the sum is stored in `sums`; the last one moves to place + 1

void main() {
  int layer = int(gl_GlobalInvocationID.z);
  vec4 total = vec4(0.0);
  for (int k = 0; k < parts; k++) {
    total += imageLoad(result, ivec3(k, 0, layer));
  }
  imageStore(sums, ivec3(place + 1, 0, layer), imageLoad(sums, ivec3(place, 0, layer)));
  imageStore(sums, ivec3(place, 0, layer), total);
}

#elif defined(TURN)
// Makes the next direction from the guess.
layout(rgba32f) uniform readonly image2DArray values;
layout(rgba32f) uniform readonly image2DArray sums;  // residual · guess of this iteration and of the last
layout(rgba32f) uniform image2DArray result;
uniform int fresh;

void at(ivec3 p) {
  vec4 now = imageLoad(sums, ivec3(0, 0, p.z));
  vec4 before = imageLoad(sums, ivec3(1, 0, p.z));
  vec4 turned = imageLoad(values, p);
  if (fresh == 0) {
    vec4 goes_on = vec4(greaterThan(before, vec4(0.0)));
    turned += goes_on * now / max(before, vec4(1e-37)) * imageLoad(result, p);
  }
  imageStore(result, p, turned);
}

#elif defined(STEP)
// Steps along the direction: updates the solution and the residual.
uniform sampler2DArray sums;  // residual · guess, and −direction · answer (MISSING in multigrid.glsl changes the sign)
layout(rgba32f) uniform readonly image2DArray values, right;
layout(rgba32f) uniform image2DArray solution, result;

void at(ivec3 p) {
  vec4 power = texelFetch(sums, ivec3(0, 0, p.z), 0);
  vec4 answer = texelFetch(sums, ivec3(2, 0, p.z), 0);
  vec4 way = vec4(lessThan(answer, vec4(0.0))) * power / max(-answer, vec4(1e-37));
  imageStore(solution, p, imageLoad(solution, p) + way * imageLoad(values, p));
  imageStore(result, p, imageLoad(result, p) + way * imageLoad(right, p));
}
#endif

#if defined(LINKS) || defined(TURN) || defined(STEP)
#  define PLACE IN_EIGHTS
#  include "cells.glsl"
#endif
