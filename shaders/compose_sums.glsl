// Composes like compose_pieces.glsl, from running sums: a piece takes four look-ups, whatever its length.
// table: 2 · GROUPS + 1 vectors of gains, then ROWS pieces, as in include/compose.glsl. Time 0 of the window lies `origin`
// positions after the first sum. BACK: time runs backwards. Only whole frames are counted from the first sum: where sums
// begin must not change a picture.
layout(local_size_x = 64, local_size_y = 2) in;
layout(rgba32f) uniform readonly image2DArray coefficients;
layout(STORED) uniform readonly uimage2DArray sums;
layout(std140) uniform table_block { vec4 table[TABLE]; };
uniform ivec2 size;
uniform int top, block_bits, origin, layers, first_layer, held;
uniform float unit;
#include "light.glsl"
#include "finish.glsl"
#include "sums.glsl"
#define COLUMNS (2 * GROUPS + 1)

// Pixels above one another that an invocation composes. On a software renderer, one and four are slower.
#define PIXELS 2
#define EACH(does) does(0); does(1)

vec4 c[PIXELS * GROUPS];
ivec3 place[PIXELS];  // where each pixel's sums are
LIGHT total[PIXELS];
vec4 starts[GROUPS];
vec4 ends[GROUPS];
float exposure;
ivec2 corner;

// Pixels beyond the picture's edge repeat the last one.
ivec2 pixel_at(int k) {
  return ivec2(corner.x, min(corner.y + k, size.y - 1));
}

void start_pixel(int k) {
  float sum = 0.0;
  for (int g = 0; g < GROUPS; g++) {
    vec4 loaded = imageLoad(coefficients, ivec3((pixel_at(k) + ivec2(0, top)) >> block_bits, g));
    c[k * GROUPS + g] = max(loaded, 0.0);
    sum += dot(c[k * GROUPS + g], vec4(1.0));
  }
  for (int g = 0; g < GROUPS; g++) {
    c[k * GROUPS + g] *= 1.0 / sum;
  }
  place[k] = place_of_sums(pixel_at(k));
  total[k] = LIGHT(0.0);
}

SUM sum_until(int k, int time) {
  int layer = clamp(BACK != 0 ? origin - time : origin + time, 0, held) + first_layer;
  return sum_at(place[k], layer < layers ? layer : layer - layers);
}

LIGHT light_between(SUM early, SUM late) {
  return unpacked_light(BACK != 0 ? minus(early, late) : minus(late, early));
}

void add_piece(int k) {
  float start = 0.0;
  float end = 0.0;
  for (int g = 0; g < GROUPS; g++) {
    start += dot(starts[g], c[k * GROUPS + g]);
    end += dot(ends[g], c[k * GROUPS + g]);
  }
  int first = int(start);
  int last = int(end);
  SUM early = sum_until(k, first);
  SUM late = sum_until(k, last);
  LIGHT light = light_between(early, late) + (end - float(last)) * light_between(late, sum_until(k, last + 1)) -
               (start - float(first)) * light_between(early, sum_until(k, first + 1));
  total[k] += light * (exposure / max(end - start, 1e-7));
}

void finish_pixel(int k) {
  ivec2 pixel = pixel_at(k);
  vec4 color = covered(total[k] * unit);
#if ENCODED
  color.rgb = to_linear_exact(straight(color)) * color.a;
#endif
  float gain = 0.0;
  for (int g = 0; g < GROUPS; g++) {
    gain += dot(starts[g], c[k * GROUPS + g]);
  }
  color.rgb *= gain;
  finish(pixel + ivec2(0, top), color);
}

void main() {
  corner = ivec2(gl_GlobalInvocationID.xy) * ivec2(1, PIXELS);
  if (any(greaterThanEqual(corner, size))) {
    return;
  }
  EACH(start_pixel);
  for (int row = 1; row <= ROWS; row++) {
    for (int g = 0; g < GROUPS; g++) {
      starts[g] = table[row * COLUMNS + g];
      ends[g] = table[row * COLUMNS + GROUPS + g];
    }
    exposure = table[row * COLUMNS + 2 * GROUPS].x;
    EACH(add_piece);
  }
  for (int g = 0; g < GROUPS; g++) {
    starts[g] = table[g];  // the gains
  }
  EACH(finish_pixel);
}
