// Frames that are not seen where a pixel lies, but where what its shutters follow was: one resampling a frame.
// frames: some of the window's, in layers; or with PACKED packed_frames, as shaders/pack.glsl makes them.
// moves: a row for each of the window's frames and of `motions`, of which there are several where pictures are mixed: the
// frame's layer (−1: it is not among these) and whether it is there at all; then a texel for each motion that is mixed, one
// per shutter, MIXED of them: turn − 1 and shift, real and imaginary parts. seen_first to seen_last: the window's frames that are there.
// table: as for compose.glsl, a row for each frame and motion; from row `parts` on, one for each motion: 1 for its shutters.
// SEVERAL: other passes have other frames. CONTINUED: what those before have summed is in `summed`; UNFINISHED: another
// one follows. SHARP: as in core.pixels.compositor.seen.
layout(rgba32f) uniform readonly image2DArray moves;
uniform int motions;
#if PACKED
layout(rgba16ui) uniform readonly uimage2DArray packed_frames;
#endif
#if EDGES == 2
uniform int seen_first, seen_last;
#endif
#if EDGES == 2 || THRESHOLD
uniform int parts;
#endif
#if CONTINUED
uniform sampler2DArray summed;
#endif

int motion = 0;

vec4 moved_weights(float t) {
  return vec4(((1.0 - 0.5 * t) * t - 0.5) * t,
              (1.5 * t - 2.5) * t * t + 1.0,
              ((2.0 - 1.5 * t) * t + 0.5) * t,
              (0.5 * t - 0.5) * t * t);
}

// The distance from a pixel to the place that is seen there, its whole and its broken part. Beyond the frame's last
// pixels all is the same, and large numbers have no fractions.
void part(ivec2 pixel, vec2 away, out ivec2 whole, out vec2 broken) {
  away = clamp(away, vec2(-1 - pixel), vec2(size - pixel));
  vec2 below = floor(away);
  whole = ivec2(below);
  broken = away - below;
}

#if PACKED
#include "packed.glsl"

// Of a column of four pixels, two pairs.
struct Column {
  vec3 a, b, c, d;
};

Column column_at(ivec2 place, int layer) {
  uvec2 upper = words_of(imageLoad(packed_frames, ivec3(place, layer)));
  uvec2 lower = words_of(imageLoad(packed_frames, ivec3(place + ivec2(0, 2), layer)));
  Column column;
  column.a = unpacked_color(upper.x);
  column.b = unpacked_color(upper.y);
  column.c = unpacked_color(lower.x);
  column.d = unpacked_color(lower.y);
  return column;
}

vec3 column_light(Column column, vec4 y) {
  return y.x * column.a + y.y * column.b + y.z * column.c + y.w * column.d;
}

// The light of a frame at a pixel and a distance from it.
vec4 seen_light(ivec2 pixel, vec2 away, int layer) {
  ivec2 whole;
  vec2 t;
  part(pixel, away, whole, t);
  ivec2 place = pixel + whole + BEFORE - 1;
  vec4 x = moved_weights(t.x);
  vec4 y = moved_weights(t.y);
  Column left = column_at(place + ivec2(1, 0), layer);
  Column right = column_at(place + ivec2(2, 0), layer);
  vec3 light = x.x * column_light(column_at(place, layer), y) + x.y * column_light(left, y) +
               x.z * column_light(right, y) + x.w * column_light(column_at(place + ivec2(3, 0), layer), y);
  light = clamp(light, min(min(left.b, left.c), min(right.b, right.c)), max(max(left.b, left.c), max(right.b, right.c)));
  return vec4(light * PACKED_UNIT, 1.0);
}
#else
// The light of a frame at a pixel and a distance from it.
vec4 seen_light(ivec2 pixel, vec2 away, int layer) {
  ivec2 whole;
  vec2 t;
  part(pixel, away, whole, t);
  ivec2 b = pixel + whole;
  ivec2 last_pixel = size - 1;
  ivec2 c_ = clamp(b + 1, ivec2(0), last_pixel);
  ivec2 a = clamp(b - 1, ivec2(0), last_pixel);
  ivec2 d = clamp(b + 2, ivec2(0), last_pixel);
  b = clamp(b, ivec2(0), last_pixel);
  vec4 bb = frame_light(b, layer);
  vec4 cb = frame_light(ivec2(c_.x, b.y), layer);
  vec4 bc = frame_light(ivec2(b.x, c_.y), layer);
  vec4 cc = frame_light(c_, layer);
#if SHARP
  vec4 x = moved_weights(t.x);
  vec4 y = moved_weights(t.y);
  vec4 light = y.x * (x.x * frame_light(a, layer) + x.y * frame_light(ivec2(b.x, a.y), layer) +
                      x.z * frame_light(ivec2(c_.x, a.y), layer) + x.w * frame_light(ivec2(d.x, a.y), layer));
  light += y.y * (x.x * frame_light(ivec2(a.x, b.y), layer) + x.y * bb + x.z * cb +
                  x.w * frame_light(ivec2(d.x, b.y), layer));
  light += y.z * (x.x * frame_light(ivec2(a.x, c_.y), layer) + x.y * bc + x.z * cc +
                  x.w * frame_light(ivec2(d.x, c_.y), layer));
  light += y.w * (x.x * frame_light(ivec2(a.x, d.y), layer) + x.y * frame_light(ivec2(b.x, d.y), layer) +
                  x.z * frame_light(ivec2(c_.x, d.y), layer) + x.w * frame_light(d, layer));
  return clamp(light, min(min(bb, cb), min(bc, cc)), max(max(bb, cb), max(bc, cc)));
#else
  return mix(mix(bb, cb, t.x), mix(bc, cc, t.x), t.y);
#endif
}

#endif

// turn · z + shift − z, where a pixel's (turn − 1, shift) is `move`.
vec2 moved_by(vec4 move, ivec2 pixel) {
  vec2 z = vec2(pixel);
  return vec2(move.x * z.x - move.y * z.y, move.y * z.x + move.x * z.y) + move.zw;
}

// (turn − 1, shift) of a quad's pixels, a column each.
mat4 moves_of(int quad, int row) {
#if MIXED == 1
  vec4 own = imageLoad(moves, ivec3(1, row, 0));
  return mat4(own, own, own, own);
#else
  mat4 sum = mat4(0.0);
  for (int i = 0; i < MIXED; i++) {
    vec4 own = imageLoad(moves, ivec3(1 + i, row, 0));
    for (int pixel = 0; pixel < 4; pixel++) {
      sum[pixel] += c[quad * GROUPS + i / 4][pixel][i % 4] * own;
    }
  }
  return sum;
#endif
}

#if COMBINE
// A frame as it is seen by all motions: its light, weighted, how much it counts, and whether it is among these frames.
mat4 sight[QUADS];
vec4 sight_weight[QUADS];
bool is_here;
#  if THRESHOLD
mat4 shown_sight[QUADS];  // its light, whatever it counts
#  endif

void start_sight(int quad) {
  sight[quad] = mat4(0.0);
  sight_weight[quad] = vec4(0.0);
#  if THRESHOLD
  shown_sight[quad] = mat4(0.0);
#  endif
}

void add_sight(int quad, int pixel, vec4 light, float weight) {
  sight[quad][pixel] += weight * light;
#  if THRESHOLD
  // How much of the pixel's coefficients is that of the motion's shutters.
  float part = 0.0;
  for (int g = 0; g < GROUPS; g++) {
    part += dot(c[quad * GROUPS + g][pixel], imageLoad(table, ivec3(g, parts + motion, 0)));
  }
  shown_sight[quad][pixel] += part * light;
#  endif
}

void fold_sight(int quad, int frame) {
  for (int pixel = 0; pixel < 4; pixel++) {
    float weight = sight_weight[quad][pixel];
    vec4 light = sight[quad][pixel] / max(weight, 1e-30);
    share[quad][pixel] = max(share[quad][pixel], weight);
    weight = is_here ? weight : 0.0;
#  if THRESHOLD
    fold(quad, pixel, light, weight * passed(light));
    fold(quad, pixel, shown_sight[quad][pixel], is_here && frame == shown ? 1.0 : 0.0);
    share[quad][pixel] = frame == shown ? 1.0 : share[quad][pixel];
#  else
    fold(quad, pixel, light, weight);
#  endif
  }
}
#endif

void expose(int quad, int frame, vec4 weight) {
  int row = frame * motions + motion;
  vec4 place = imageLoad(moves, ivec3(0, row, 0));
#if !COMBINE || !VALUE
  centre[quad] += weight * (float(frame) + 0.5);
#endif
  weight *= place.y;
#if COMBINE
  weight *= gain[quad];
  sight_weight[quad] += weight;
  is_here = place.x >= 0.0;
#else
  share[quad] += weight;
#endif
#if SEVERAL
  // A loop, for software renderers run both sides of a branch; and it is dear to them as well.
#  if THRESHOLD
  int layer = frame == shown || any(greaterThan(weight, vec4(0.0))) ? int(place.x) : -1;
#  else
  int layer = any(greaterThan(weight, vec4(0.0))) ? int(place.x) : -1;
#  endif
  for (; layer >= 0; layer = -1)
#else
  int layer = max(int(place.x), 0);
#endif
  {
    mat4 move = moves_of(quad, row);
#if COMBINE
    for (int pixel = 0; pixel < 4; pixel++) {
      ivec2 own = pixel_at(quad, pixel);
      add_sight(quad, pixel, seen_light(own, moved_by(move[pixel], own), layer), weight[pixel]);
    }
#else
    mat4 light;
    light[0] = weight.x * seen_light(pixel_at(quad, 0), moved_by(move[0], pixel_at(quad, 0)), layer);
    light[1] = weight.y * seen_light(pixel_at(quad, 1), moved_by(move[1], pixel_at(quad, 1)), layer);
    light[2] = weight.z * seen_light(pixel_at(quad, 2), moved_by(move[2], pixel_at(quad, 2)), layer);
    light[3] = weight.w * seen_light(pixel_at(quad, 3), moved_by(move[3], pixel_at(quad, 3)), layer);
    total[quad] += light;
#endif
  }
}

#if EDGES == 2  // shorten
// A pixel's light in the frame that is nearest to its exposure's time, if it is among these frames.
vec4 nearest_light(int quad, int pixel, int frame) {
  int nearest = clamp(frame, seen_first, seen_last);
  vec4 light = vec4(0.0);
  for (motion = 0; motion < motions; motion++) {
    int row = nearest * motions + motion;
    float part = 0.0;
    for (int g = 0; g < GROUPS; g++) {
      part += dot(c[quad * GROUPS + g][pixel], imageLoad(table, ivec3(g, parts + motion, 0)));
    }
    int layer = int(imageLoad(moves, ivec3(0, row, 0)).x);
    ivec2 own_pixel = pixel_at(quad, pixel);
    vec4 found = seen_light(own_pixel, moved_by(moves_of(quad, row)[pixel], own_pixel), max(layer, 0));
    light += layer < 0 ? vec4(0.0) : part * found;
  }
  return light;
}
#endif
