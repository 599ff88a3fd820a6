// Composes by displacement interpolation, exactly (paper §3.4.1). A pixel's quantile is Σ cᵢ Sᵢ⁻¹, linear between the
// knots of the table. Each piece spreads its share evenly over its frames. Fast for few pieces: every piece fetches its
// frames again.
uniform int rows, first, last;  // first, last: the exposed frames; rounding must not reach others, which may be missing
#include "compose.glsl"

int frame;
vec4 start[QUADS];  // when the piece starts in each pixel
vec4 end[QUADS];
vec4 density[QUADS];
float from, until;  // when the block's pixels are exposed

void start_piece(int quad, int row) {
  start[quad] = mixed(quad, 0, row);
  end[quad] = mixed(quad, GROUPS, row);
  density[quad] = imageLoad(table, ivec3(2 * GROUPS, row, 0)).r / max(end[quad] - start[quad], 1e-7);
  vec2 low = min(start[quad].xy, start[quad].zw);
  vec2 high = max(end[quad].xy, end[quad].zw);
  from = min(from, min(low.x, low.y));
  until = max(until, max(high.x, high.y));
}

void add_frame(int quad) {
  vec4 open = min(end[quad], float(frame + 1)) - max(start[quad], float(frame));
  expose(quad, frame, max(open, 0.0) * density[quad]);
}

void expose_frames() {
  for (int row = 1; row <= rows; row++) {
    from = 1e9;
    until = 0.0;
#define START(quad) start_piece(quad, row)
    EACH(START);
    until = min(until, float(last));
    for (frame = max(int(from), first); float(frame) < until; frame++) {
      EACH(add_frame);
    }
  }
}
#include "blocks.glsl"
