// Composes like compose_pieces.glsl, but fetches every frame once, which suits many pieces. A frame's weight is Q at its
// end less Q at its start. Pieces that have ended in every pixel of the block are summed once for all; only the others,
// about one for each frame, are evaluated for each pixel.
uniform int rows, first, last;
#include "compose.glsl"

int frame;
float boundary;  // the frame's end
vec4 before[QUADS];  // Q at the frame's start
vec4 after[QUADS];
vec4 middle[GROUPS];  // the mean of the block's coefficients
float reach = 0.0;  // the largest distance of any pixel's coefficients from it: half the sum of the differences

void add_to_middle(int quad) {
  for (int g = 0; g < GROUPS; g++) {
    middle[g] += c[quad * GROUPS + g] * vec4(0.25 / float(QUADS));
  }
}

void widen_reach(int quad) {
  vec4 apart = vec4(0.0);
  for (int g = 0; g < GROUPS; g++) {
    mat4 own = c[quad * GROUPS + g];
    apart += vec4(dot(abs(own[0] - middle[g]), vec4(0.5)),
                  dot(abs(own[1] - middle[g]), vec4(0.5)),
                  dot(abs(own[2] - middle[g]), vec4(0.5)),
                  dot(abs(own[3] - middle[g]), vec4(0.5)));
  }
  reach = max(reach, max(max(apart.x, apart.y), max(apart.z, apart.w)));
}

#if MOVED
// When the block's pixels are exposed. Resampling a frame costs too much where none of them exposes it.
float from = 1e9;
float until = 0.0;

void widen_exposure(int quad) {
  vec4 start = mixed(quad, 0, 1);
  vec4 end = mixed(quad, GROUPS, rows);
  vec2 low = min(start.xy, start.zw);
  vec2 high = max(end.xy, end.zw);
  from = min(from, min(low.x, low.y));
  until = max(until, max(high.x, high.y));
}
#endif

// The quantile of `middle` in a row of the table, at the piece's start (column 0) or end (column GROUPS).
float middle_time(int column, int row) {
  float time = 0.0;
  for (int g = 0; g < GROUPS; g++) {
    time += dot(middle[g], imageLoad(table, ivec3(column + g, row, 0)));
  }
  return time;
}

// dz, and the most by which the shutters' times differ: a pixel's time is at most `reach` times that from the middle's.
vec2 extent_of(int row) {
  return imageLoad(table, ivec3(2 * GROUPS, row, 0)).rg;
}

void add_piece(int quad, int row, float dz) {
  vec4 start = mixed(quad, 0, row);
  vec4 end = mixed(quad, GROUPS, row);
  after[quad] += dz * clamp((boundary - start) / max(end - start, 1e-7), 0.0, 1.0);
}

void add_frame(int quad) {
  start_sight(quad);
  expose(quad, frame, after[quad] - before[quad]);
  fold_sight(quad, frame);
  before[quad] = after[quad];
}

void expose_frames() {
  for (int g = 0; g < GROUPS; g++) {
    middle[g] = vec4(0.0);
  }
  EACH(add_to_middle);
  EACH(widen_reach);
#define CLEAR(quad) before[quad] = vec4(0.0)
  EACH(CLEAR);
  float passed = 0.0;
  int row = 1;
  int begin = first;
  int end = last;
#if MOVED
  EACH(widen_exposure);
#  if THRESHOLD
  from = min(from, float(shown));
  until = max(until, float(shown + 1));
#  endif
  begin = max(begin, int(from));
  end = min(end, int(ceil(until)));
#endif
  for (frame = begin; frame < end; frame++) {
    boundary = float(frame + 1);
    for (; row <= rows; row++) {
      vec2 extent = extent_of(row);
      if (middle_time(GROUPS, row) + reach * extent.y > boundary) {
        break;
      }
      passed += extent.x;
    }
#define PASS(quad) after[quad] = vec4(passed)
    EACH(PASS);
    for (int inside = row; inside <= rows; inside++) {
      vec2 extent = extent_of(inside);
      if (middle_time(0, inside) - reach * extent.y >= boundary) {
        break;
      }
#define ADD(quad) add_piece(quad, inside, extent.x)
      EACH(ADD);
    }
    EACH(add_frame);
  }
}
#include "blocks.glsl"
