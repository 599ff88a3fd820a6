// As compose_frames.glsl, every pixel for itself: it walks through pieces and frames together, each once.
// For many pieces between shutters that lie far apart in time, which neighbours do not share: there, looking at pieces
// for a whole block takes pieces times frames, and more loops than software renderers go through.
#define QUADS 1
#include "compose.glsl"

int frame;
float boundary;  // the frame's end
vec4 before = vec4(0.0);  // Q at the frame's start
ivec4 row = ivec4(1);  // of each pixel: the first piece that does not end before the boundary
vec4 passed = vec4(0.0);  // and the exposure before it

// A pixel's quantile in the table's row, at the piece's start (column 0) or end (column GROUPS).
float time_at(int pixel, int column, int row)
{
  float time = 0.0;
  for (int g = 0; g < GROUPS; g++) {
    time += dot(c[g][pixel], imageLoad(table, ivec3(column + g, row, 0)));
  }
  return time;
}

// Q of a pixel at the boundary.
float walked(int pixel, inout int row, inout float passed)
{
  for (; row <= rows; row++) {
    float start = time_at(pixel, 0, row);
    float end = time_at(pixel, GROUPS, row);
    float dz = imageLoad(table, ivec3(2 * GROUPS, row, 0)).r;
    float share = clamp((boundary - start) / max(end - start, 1e-7), 0.0, 1.0);
    if (share < 1.0) {
      return passed + dz * share;
    }
    passed += dz;
  }
  return passed;
}

void main()
{
  if (!start_block()) {
    return;
  }
  for (frame = first; frame < last; frame++) {
    boundary = float(frame + 1);
    vec4 after = vec4(walked(0, row.x, passed.x), walked(1, row.y, passed.y),
                      walked(2, row.z, passed.z), walked(3, row.w, passed.w));
    expose(0, frame, after - before);
    before = after;
  }
  finish_quad(0);
}
