// Composes like compose_frames.glsl, but each pixel finds its own piece for each frame by bisection. Used where
// neighbouring pixels share few pieces: compose_frames would take more loop iterations than software renderers allow.
uniform int rows, first, last;
#include "compose.glsl"

int frame;
float boundary;  // the frame's end
vec4 before;  // Q at the frame's start
ivec4 row;  // each pixel's first piece that does not end before the boundary

// A pixel's quantile in a row of the table, at the piece's start (column 0) or end (column GROUPS).
float time_at(int pixel, int column, int row) {
  float time = 0.0;
  for (int g = 0; g < GROUPS; g++) {
    time += dot(c[g][pixel], imageLoad(table, ivec3(column + g, row, 0)));
  }
  return time;
}

// Q of a pixel at the boundary. row: where the search for its piece starts; becomes that piece.
float searched(int pixel, inout int row) {
  int end = rows + 1;
  while (row < end) {
    int middle = (row + end) / 2;
    bool passed = time_at(pixel, GROUPS, middle) <= boundary;
    row = passed ? middle + 1 : row;
    end = passed ? end : middle;
  }
  if (row > rows) {
    return 1.0;
  }
  vec4 piece = imageLoad(table, ivec3(2 * GROUPS, row, 0));
  float from = time_at(pixel, 0, row);
  float until = time_at(pixel, GROUPS, row);
  return piece.z + piece.x * clamp((boundary - from) / max(until - from, 1e-7), 0.0, 1.0);
}

void expose_frames() {
  row = ivec4(1);
  before = vec4(0.0);
  for (frame = first; frame < last; frame++) {
    boundary = float(frame + 1);
    vec4 after = vec4(searched(0, row.x), searched(1, row.y), searched(2, row.z), searched(3, row.w));
    start_sight(0);
    expose(0, frame, after - before);
    fold_sight(0, frame);
    before = after;
  }
}
#include "blocks.glsl"
