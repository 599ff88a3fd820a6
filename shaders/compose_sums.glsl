// Composes like compose_pieces.glsl, from running sums: a knot takes two look-ups, whatever lies between it and the last.
// table: GROUPS + 1 vectors of gains, then ROWS knots of the shutters' quantiles: times, and the exposure since the last
// knot. Time 0 of the window lies `origin` positions after the first sum. BACK: time runs backwards. Only whole frames are
// counted from the first sum: where sums begin must not change a picture.
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
#define COLUMNS (GROUPS + 1)

// Pixels above one another that an invocation composes. On a software renderer, one and four are slower.
#define PIXELS 2
#define EACH(does) does(0); does(1)

vec4 c[PIXELS * GROUPS];
ivec3 place[PIXELS];  // where each pixel's sums are
LIGHT total[PIXELS];
float last[PIXELS];  // the time of the last knot, the sum of the whole frames before it, and the light of the rest
SUM last_sum[PIXELS];
LIGHT last_rest[PIXELS];
vec4 row[COLUMNS];  // of the table
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
  last[k] = 0.0;
  last_sum[k] = SUM(0u);
  last_rest[k] = LIGHT(0.0);
}

SUM sum_until(int k, int time) {
  int layer = clamp(BACK != 0 ? origin - time : origin + time, 0, held) + first_layer;
  return sum_at(place[k], layer < layers ? layer : layer - layers);
}

LIGHT light_between(SUM early, SUM late) {
  return unpacked_light(BACK != 0 ? minus(early, late) : minus(late, early));
}

float mixed(int k) {
  float mean = 0.0;
  for (int g = 0; g < GROUPS; g++) {
    mean += dot(row[g], c[k * GROUPS + g]);
  }
  return mean;
}

void move_to_knot(int k) {
  float time = mixed(k);
  int whole = int(time);
  SUM sum = sum_until(k, whole);
  LIGHT rest = (time - float(whole)) * light_between(sum, sum_until(k, whole + 1));
  LIGHT light = light_between(last_sum[k], sum) + rest - last_rest[k];
  total[k] += light * (row[GROUPS].x / max(time - last[k], 1e-7));
  last[k] = time;
  last_sum[k] = sum;
  last_rest[k] = rest;
}

void finish_pixel(int k) {
  ivec2 pixel = pixel_at(k);
  vec4 color = covered(total[k] * unit);
#if ENCODED
  color.rgb = to_linear_exact(straight(color)) * color.a;
#endif
  color.rgb *= mixed(k);
  finish(pixel + ivec2(0, top), color);
}

void main() {
  corner = ivec2(gl_GlobalInvocationID.xy) * ivec2(1, PIXELS);
  if (any(greaterThanEqual(corner, size))) {
    return;
  }
  EACH(start_pixel);
  for (int knot = 1; knot <= ROWS; knot++) {
    for (int g = 0; g < COLUMNS; g++) {
      row[g] = table[knot * COLUMNS + g];
    }
    EACH(move_to_knot);
  }
  for (int g = 0; g < GROUPS; g++) {
    row[g] = table[g];  // the gains
  }
  EACH(finish_pixel);
}
