// The operators of compute/diffusion_gpu.py. Cells of coarser grids are coupled by a STENCIL, pixels by LINKS that follow
// edges, or by links of 1. Weights: how much each cell takes of the four coarse cells around it.
#include "tiles.glsl"

#ifdef STENCIL
// Layers: the entries for the four cells before a cell; for the four behind it; 1 / its own entry, and that. 0 at edges.
layout(rgba32f) uniform readonly image2DArray stencil;

bool is_free(ivec2 i) {
  return inside(i, size) && imageLoad(stencil, ivec3(i, 2)).x > 0.0;
}
#elif defined(LINKS)
layout(rgba32f) uniform readonly image2DArray links;  // above, left, right, below; zeros for fixed pixels

vec4 links_of(ivec2 i) {
  return inside(i, size) ? imageLoad(links, ivec3(i, 0)) : vec4(0.0);
}

bool is_free(ivec2 i) {
  return dot(links_of(i), vec4(1.0)) > 0.0;
}
#elif !defined(RESTRICT)
layout(r32ui) uniform readonly uimage2DArray labels;

bool is_free(ivec2 i) {
  return inside(i, size) && imageLoad(labels, ivec3(i, 0)).r == 0u;
}

vec4 links_of(ivec2 i) {
  return is_free(i) ? vec4(i.y > 0, i.x > 0, i.x < size.x - 1, i.y < size.y - 1) : vec4(0.0);
}
#endif

#ifdef WEIGHTS
// Makes the weights: on a line between two coarse cells from the couplings on either side, between four of them from the
// cell's own equation. Cells beside a dot take a little of the coarse cell under it, or coarser grids would have nothing
// near. Beyond the last coarse cell, a cell takes from that one only.
layout(rgba32f) uniform writeonly image2DArray weights;
uniform float hold;

// The couplings of the free cell i to the free cells around it, and its diagonal; zeros for a fixed cell.
void couplings(ivec2 i, out float c[9], out float diagonal) {
#  ifdef STENCIL
  diagonal = 0.0;
  for (int k = 0; k < 9; k++) {
    c[k] = 0.0;
  }
  if (inside(i, size)) {
    vec4 before = imageLoad(stencil, ivec3(i, 0));
    vec4 after = imageLoad(stencil, ivec3(i, 1));
    diagonal = imageLoad(stencil, ivec3(i, 2)).y;
    for (int k = 0; k < 4; k++) {
      c[k] = -before[k];
      c[k + 5] = -after[k];
    }
  }
#  else
  vec4 tied = links_of(i);
  diagonal = dot(tied, vec4(1.0));
  for (int k = 0; k < 9; k++) {
    c[k] = k % 2 == 1 && is_free(i + OFFSET(k)) ? tied[k / 2] : 0.0;
  }
#  endif
}

bool is_fixed(ivec2 i) {
  return inside(i, size) && !is_free(i);
}

// Whether the coarse cell at i is fixed but its neighbours across the line are not: a dot, no wall.
bool is_dot(ivec2 i, ivec2 across) {
  return is_fixed(i) && !is_fixed(i + across) && !is_fixed(i - across);
}

// How much a cell takes of the coarse cells before and after it in its row, or in its column.
vec2 between(ivec2 i, bool in_row) {
  float c[9];
  float diagonal;
  couplings(i, c, diagonal);
  float coupled = 0.0;
  for (int k = 0; k < 9; k++) {
    coupled += c[k];
  }
  // How much of the cell's diagonal is coupled to free cells.
  float follows = diagonal > 0.0 ? clamp(coupled / diagonal, 0.0, 1.0) : 0.0;
  ivec2 along = in_row ? ivec2(1, 0) : ivec2(0, 1);
  ivec2 before = i - along;
  ivec2 after = i + along;
  if (!inside(after, size)) {
    return vec2(follows, 0.0);
  }
  bvec2 dots = bvec2(is_dot(before, along.yx), is_dot(after, along.yx));
  if (any(dots)) {
    return follows * mix(vec2(is_free(before), is_free(after)) * 2.0 / 3.0, vec2(1.0 / 6.0), dots);
  }
  vec2 ends = in_row ? vec2(c[0] + c[3] + c[6], c[2] + c[5] + c[8]) : vec2(c[0] + c[1] + c[2], c[6] + c[7] + c[8]);
  // What holds the cell first counts on the side that pulls less. The rest, off the line, holds the coarse cells as well.
  float pull = ends.x + ends.y;
  float held = max(0.0, diagonal - pull - (in_row ? c[1] + c[7] : c[3] + c[5]));
  float aside = max(0.0, held - abs(ends.x - ends.y));
  float total = pull + held - (1.0 - hold) * aside;
  return total > 1e-3 * diagonal ? ends / total : vec2(0.0);
}

void store(ivec2 i, vec4 value) {
  if (inside(i, size)) {
    imageStore(weights, ivec3(i, 0), value);
  }
}

// Invocations (·, y) cover two tiles, 2 × 2 cells each.
void main() {
  ivec2 id = ivec2(gl_GlobalInvocationID);
  ivec2 p = corner(first + 2 * id.y + (id.x >> 2), size) + 2 * ivec2(id.x & 1, id.x >> 1 & 1);
  if (!inside(p, size)) {
    return;
  }
  float c[9];
  float diagonal;
  couplings(p, c, diagonal);
  vec2 above = between(p + ivec2(1, 0), true);
  vec2 below = between(p + ivec2(1, 2), true);
  vec2 before = between(p + ivec2(0, 1), false);
  vec2 after = between(p + ivec2(2, 1), false);
  store(p, vec4(diagonal > 0.0 ? 1.0 : 0.0, 0.0, 0.0, 0.0));
  store(p + ivec2(1, 0), vec4(above, 0.0, 0.0));
  store(p + ivec2(0, 1), vec4(before.x, 0.0, before.y, 0.0));
  couplings(p + 1, c, diagonal);
  vec4 middle = vec4(c[0] + c[1] * above.x + c[3] * before.x,
                     c[2] + c[1] * above.y + c[5] * after.x,
                     c[6] + c[7] * below.x + c[3] * before.y,
                     c[8] + c[7] * below.y + c[5] * after.y);
  store(p + 1, diagonal > 0.0 ? middle / diagonal : vec4(0.0));
}

#elif defined(COARSEN) || defined(RESTRICT)
layout(rgba32f) uniform readonly image2DArray weights;
layout(rgba32f) uniform writeonly image2DArray next;  // of the next coarser grid
uniform ivec2 coarse;  // its size

// The 5 × 5 cells around one: n = 0 … 24, itself 12. AMONG_25: the number there of cell k of 3 × 3.
#  define OFFSET_OF_25(n) (ivec2((n) % 5, (n) / 5) - 2)
#  define AMONG_25(k) (5 * ((k) / 3 + 1) + (k) % 3 + 1)
// Which of a cell's four weights belongs to the coarse cell p, if the cell lies OFFSET(k) from 2p.
#  define TAKES(k) (((k) % 3 == 0 ? 1 : 0) + ((k) / 3 == 0 ? 2 : 0))

// Calls a function for each of 3 × 3 or 5 × 5 cells. A loop would move the arrays that it indexes to memory.
#  define EACH_OF_9(does) \
    does(0); does(1); does(2); does(3); does(4); does(5); does(6); does(7); does(8)
#  define EACH_OF_25(does) \
    EACH_OF_9(does); does(9); does(10); does(11); does(12); does(13); does(14); does(15); does(16); \
    does(17); does(18); does(19); does(20); does(21); does(22); does(23); does(24)
#endif

#ifdef COARSEN
// Makes the next operator, PᵀAP.
ivec2 p;
float row[9];
float product[25];  // for the cells 2p − 2 … 2p + 2

// Adds row i of A; its cell has number `at` among the 25.
void add_row(ivec2 i, int at, float weight) {
#  ifdef STENCIL
  vec4 before = weight * imageLoad(stencil, ivec3(i, 0));
  vec4 after = weight * imageLoad(stencil, ivec3(i, 1));
  product[at - 6] += before.x;
  product[at - 5] += before.y;
  product[at - 4] += before.z;
  product[at - 1] += before.w;
  product[at] += weight * imageLoad(stencil, ivec3(i, 2)).y;
  product[at + 1] += after.x;
  product[at + 4] += after.y;
  product[at + 5] += after.z;
  product[at + 6] += after.w;
#  else
  vec4 tied = weight * links_of(i);
  product[at - 5] -= tied.x;
  product[at - 1] -= tied.y;
  product[at + 1] -= tied.z;
  product[at + 5] -= tied.w;
  product[at] += dot(tied, vec4(1.0));
#  endif
}

void add_equation(int k) {
  ivec2 i = 2 * p + OFFSET(k);
  if (inside(i, size)) {
    add_row(i, AMONG_25(k), imageLoad(weights, ivec3(i, 0))[TAKES(k)]);
  }
}

void add_column(int n) {
  ivec2 j = 2 * p + OFFSET_OF_25(n);
  vec4 value = inside(j, size) ? product[n] * imageLoad(weights, ivec3(j, 0)) : vec4(0.0);
  int a = n % 5 / 2;
  int b = (n % 5 + 1) / 2;
  int above = 3 * (n / 5 / 2);
  int below = 3 * ((n / 5 + 1) / 2);
  row[above + a] += value.x;
  row[above + b] += value.y;
  row[below + a] += value.z;
  row[below + b] += value.w;
}

void main() {
  p = corner(coarse) + IN_FOURS;
  if (!inside(p, coarse)) {
    return;
  }
#  define CLEAR_ENTRY(k) row[k] = 0.0
#  define CLEAR_PRODUCT(n) product[n] = 0.0
  EACH_OF_9(CLEAR_ENTRY);
  EACH_OF_25(CLEAR_PRODUCT);
  EACH_OF_9(add_equation);
  EACH_OF_25(add_column);
  imageStore(next, ivec3(p, 0), vec4(row[0], row[1], row[2], row[3]));
  imageStore(next, ivec3(p, 1), vec4(row[5], row[6], row[7], row[8]));
  imageStore(next, ivec3(p, 2), vec4(row[4] > 1e-6 ? 1.0 / row[4] : 0.0, row[4], 0.0, 0.0));
}
#endif

#ifdef RESTRICT
// Restricts a grid's residual to the right side of the next grid.
layout(rgba32f) uniform readonly image2DArray own;
#  ifdef STENCIL
uniform sampler2DArray right;
#  endif
ivec3 p;
vec4 total;
vec4 near[25];  // the cells 2p − 2 … 2p + 2; beyond the frame's edge, the last ones repeated

// The residual of equation i; its cell has number `at` among the 25.
vec4 missing(ivec3 i, int at) {
#  ifdef STENCIL
  vec4 before = imageLoad(stencil, ivec3(i.xy, 0));
  vec4 after = imageLoad(stencil, ivec3(i.xy, 1));
  vec4 total = texelFetch(right, i, 0) - imageLoad(stencil, ivec3(i.xy, 2)).y * near[at];
  total -= before.x * near[at - 6] + before.y * near[at - 5] + before.z * near[at - 4] + before.w * near[at - 1];
  total -= after.x * near[at + 1] + after.y * near[at + 4] + after.z * near[at + 5] + after.w * near[at + 6];
  return total;
#  elif defined(LINKS)
  // Sums differences: a rounded diagonal would leak.
  vec4 tied = links_of(i.xy);
  vec4 self = near[at];
  return tied.x * (near[at - 5] - self) + tied.y * (near[at - 1] - self) + tied.z * (near[at + 1] - self) +
         tied.w * (near[at + 5] - self);
#  else
  return near[at - 5] + near[at - 1] + near[at + 1] + near[at + 5] - 4.0 * near[at];
#  endif
}

void load_near(int n) {
  near[n] = imageLoad(own, ivec3(clamp(2 * p.xy + OFFSET_OF_25(n), ivec2(0), size - 1), p.z));
}

void add_missing(int k) {
  ivec3 i = ivec3(2 * p.xy + OFFSET(k), p.z);
  if (inside(i.xy, size)) {
    total += imageLoad(weights, ivec3(i.xy, 0))[TAKES(k)] * missing(i, AMONG_25(k));
  }
}

void main() {
  p = ivec3(corner(coarse) + IN_FOURS, gl_GlobalInvocationID.z);
  if (!inside(p.xy, coarse)) {
    return;
  }
  EACH_OF_25(load_near);
  total = vec4(0.0);
  EACH_OF_9(add_missing);
  imageStore(next, p, total);
}
#endif

#if defined(SMOOTH) || defined(MISSING)
#  ifdef SMOOTH
layout(rgba32f) uniform image2DArray values;
#  else
layout(rgba32f) uniform readonly image2DArray values;
#  endif
#  define NEAR(x, y) imageLoad(values, ivec3(clamp(p.xy + ivec2(x, y), ivec2(0), size - 1), p.z))
#  ifdef STENCIL
layout(rgba32f) uniform readonly image2DArray right;

// The sum over the cells around p in the equation of p.
vec4 taken_around(ivec3 p) {
  vec4 before = imageLoad(stencil, ivec3(p.xy, 0));
  vec4 after = imageLoad(stencil, ivec3(p.xy, 1));
  vec4 total = before.x * NEAR(-1, -1) + before.y * NEAR(0, -1) + before.z * NEAR(1, -1) + before.w * NEAR(-1, 0);
  return total + after.x * NEAR(1, 0) + after.y * NEAR(-1, 1) + after.z * NEAR(0, 1) + after.w * NEAR(1, 1);
}
#  endif
#endif

#ifdef SMOOTH
#  ifdef STENCIL
// A quarter of a Gauss-Seidel sweep, over the cells of one of four colours.
uniform ivec2 colour;

void at(ivec3 p) {
  imageStore(values, p, (imageLoad(right, p) - taken_around(p)) * imageLoad(stencil, ivec3(p.xy, 2)).x);
}
#    define PLACE 2 * IN_FOURS + colour
#  else
// Half a red-black Gauss-Seidel sweep, over the pixels of one colour.
uniform int colour;

void at(ivec3 p) {
  vec4 tied = links_of(p.xy);
  float diagonal = dot(tied, vec4(1.0));
  if (diagonal > 0.0) {
    vec4 total = tied.x * NEAR(0, -1) + tied.y * NEAR(-1, 0) + tied.z * NEAR(1, 0) + tied.w * NEAR(0, 1);
    imageStore(values, p, total / diagonal);
  }
}
#    define PLACE IN_FOURS * ivec2(2, 1) + ivec2((IN_FOURS.y + colour) & 1, 0)
#  endif
#  include "cells.glsl"
#endif

#ifdef MISSING
// The residual of `values`, with the right side times `amount`.
layout(rgba32f) uniform writeonly image2DArray result;
uniform float amount;

void at(ivec3 p) {
  vec4 total = imageLoad(stencil, ivec3(p.xy, 2)).y * NEAR(0, 0) + taken_around(p);
  imageStore(result, p, amount * imageLoad(right, p) - total);
}
#  define PLACE IN_EIGHTS
#  include "cells.glsl"
#endif
