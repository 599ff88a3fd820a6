// Exposures that follow something: each frame is resampled once, at the place of what the pixel's shutters follow.
// SHARP: by the cubic of core/pixels/compositor.py (`seen`). frames: some of the window's frames; with PACKED,
// packed_frames of shaders/pack.glsl instead. Frames seen_first to seen_last exist.
// moves: a row for each frame and motion: the frame's layer (−1: another pass has it), whether it exists; then turn − 1 and
// shift of each shutter (MIXED of them). By value there are `motions`, one for all shutters that move alike.
// table: a row for each frame and motion; from row `parts` on, one for each motion: 1 for its shutters.
// SEVERAL: other passes have other frames. CONTINUED: `summed` has theirs so far. UNFINISHED: another pass follows.
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

vec4 moved_weights(float t) {
  return vec4(((1.0 - 0.5 * t) * t - 0.5) * t,
              (1.5 * t - 2.5) * t * t + 1.0,
              ((2.0 - 1.5 * t) * t + 0.5) * t,
              (0.5 * t - 0.5) * t * t);
}

#if PACKED
#include "packed.glsl"

// Four pixels above one another: two packed pairs.
mat4x3 column_at(ivec2 place, int layer) {
  uvec2 upper = words_of(imageLoad(packed_frames, ivec3(place, layer)));
  uvec2 lower = words_of(imageLoad(packed_frames, ivec3(place + ivec2(0, 2), layer)));
  return mat4x3(unpacked_color(upper.x), unpacked_color(upper.y), unpacked_color(lower.x), unpacked_color(lower.y));
}

vec3 column_light(mat4x3 column, vec4 y) {
  return y.x * column[0] + y.y * column[1] + y.z * column[2] + y.w * column[3];
}

// The light of a frame at a distance from a pixel.
vec4 seen_light(ivec2 pixel, vec2 away, int layer) {
  ivec2 place = pixel + ivec2(floor(away)) + BEFORE - 1;
  vec2 t = away - floor(away);
  vec4 x = moved_weights(t.x);
  vec4 y = moved_weights(t.y);
  mat4x3 left = column_at(place + ivec2(1, 0), layer);
  mat4x3 right = column_at(place + ivec2(2, 0), layer);
  vec3 light = x.x * column_light(column_at(place, layer), y) + x.y * column_light(left, y) +
               x.z * column_light(right, y) + x.w * column_light(column_at(place + ivec2(3, 0), layer), y);
  vec3 least = min(min(left[1], left[2]), min(right[1], right[2]));
  light = clamp(light, least, max(max(left[1], left[2]), max(right[1], right[2])));
  return vec4(light * PACKED_UNIT, 1.0);
}
#else
// The weighted light of four pixels of a row; second, third: the light of the two inner ones.
vec4 row_light(vec4 x, ivec4 columns, int row, vec4 second, vec4 third, int layer) {
  return x.x * frame_light(ivec2(columns.x, row), layer) + x.y * second + x.z * third +
         x.w * frame_light(ivec2(columns.w, row), layer);
}

vec4 seen_light(ivec2 pixel, vec2 away, int layer) {
  ivec2 place = pixel + ivec2(floor(away));
  vec2 t = away - floor(away);
  ivec4 across = clamp(place.x + ivec4(-1, 0, 1, 2), 0, size.x - 1);
  ivec4 down = clamp(place.y + ivec4(-1, 0, 1, 2), 0, size.y - 1);
  vec4 bb = frame_light(ivec2(across.y, down.y), layer);
  vec4 cb = frame_light(ivec2(across.z, down.y), layer);
  vec4 bc = frame_light(ivec2(across.y, down.z), layer);
  vec4 cc = frame_light(ivec2(across.z, down.z), layer);
#if SHARP
  vec4 x = moved_weights(t.x);
  vec4 y = moved_weights(t.y);
  vec4 ba = frame_light(ivec2(across.y, down.x), layer), ca = frame_light(ivec2(across.z, down.x), layer);
  vec4 bd = frame_light(ivec2(across.y, down.w), layer), cd = frame_light(ivec2(across.z, down.w), layer);
  vec4 light = y.x * row_light(x, across, down.x, ba, ca, layer) + y.y * row_light(x, across, down.y, bb, cb, layer) +
               y.z * row_light(x, across, down.z, bc, cc, layer) + y.w * row_light(x, across, down.w, bd, cd, layer);
  return clamp(light, min(min(bb, cb), min(bc, cc)), max(max(bb, cb), max(bc, cc)));
#else
  return mix(mix(bb, cb, t.x), mix(bc, cc, t.x), t.y);
#endif
}
#endif

// turn · z + shift − z for a pixel z; move: (turn − 1, shift). Clamped to the frame, since large floats have no fractions.
vec2 moved_by(vec4 move, ivec2 pixel) {
  vec2 z = vec2(pixel);
  vec2 away = vec2(move.x * z.x - move.y * z.y, move.y * z.x + move.x * z.y) + move.zw;
  return clamp(away, vec2(-1 - pixel), vec2(size - pixel));
}

// (turn − 1, shift) of a quad's pixels, in columns.
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

#if EDGES == 2 || THRESHOLD
// The sum of a pixel's coefficients over the motion's shutters.
float share_of_motion(int quad, int pixel) {
  float sum = 0.0;
  for (int g = 0; g < GROUPS; g++) {
    sum += dot(c[quad * GROUPS + g][pixel], imageLoad(table, ivec3(g, parts + motion, 0)));
  }
  return sum;
}
#endif

#if COMBINE
// A frame as all motions see it: its weighted light, its weight, and whether this pass has the frame.
mat4 sight[QUADS];
vec4 sight_weight[QUADS];
bool is_here;
#  if THRESHOLD
mat4 shown_sight[QUADS];  // its light without the weight
#  endif

void start_sight(int quad) {
  sight[quad] = mat4(0.0);
  sight_weight[quad] = vec4(0.0);
#  if THRESHOLD
  shown_sight[quad] = mat4(0.0);
#  endif
}

void fold_sight(int quad, int frame) {
  for (int pixel = 0; pixel < 4; pixel++) {
    float weight = sight_weight[quad][pixel];
    vec4 light = sight[quad][pixel] / max(weight, 1e-30);
    share[quad][pixel] = max(share[quad][pixel], weight);
    fold(quad, pixel, light, is_here ? weight * passed(light) : 0.0);
#  if THRESHOLD
    fold(quad, pixel, shown_sight[quad][pixel], is_here && frame == shown ? 1.0 : 0.0);
    share[quad][pixel] = frame == shown ? 1.0 : share[quad][pixel];
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
  bool is_exposed = any(greaterThan(weight, vec4(0.0)));
#  if THRESHOLD
  is_exposed = is_exposed || frame == shown;
#  endif
  for (int layer = is_exposed ? int(place.x) : -1; layer >= 0; layer = -1)
#else
  int layer = max(int(place.x), 0);
#endif
  {
    mat4 move = moves_of(quad, row);
#if COMBINE
    for (int pixel = 0; pixel < 4; pixel++) {
      ivec2 own = pixel_at(quad, pixel);
      vec4 light = seen_light(own, moved_by(move[pixel], own), layer);
      sight[quad][pixel] += weight[pixel] * light;
#  if THRESHOLD
      shown_sight[quad][pixel] += share_of_motion(quad, pixel) * light;
#  endif
    }
#else
    total[quad] += mat4(weight.x * seen_light(pixel_at(quad, 0), moved_by(move[0], pixel_at(quad, 0)), layer),
                        weight.y * seen_light(pixel_at(quad, 1), moved_by(move[1], pixel_at(quad, 1)), layer),
                        weight.z * seen_light(pixel_at(quad, 2), moved_by(move[2], pixel_at(quad, 2)), layer),
                        weight.w * seen_light(pixel_at(quad, 3), moved_by(move[3], pixel_at(quad, 3)), layer));
#endif
  }
}

#if EDGES == 2  // shorten
// A pixel's light in the frame nearest to the exposure's time, if this pass has it.
vec4 nearest_light(int quad, int pixel, int frame) {
  int nearest = clamp(frame, seen_first, seen_last);
  vec4 light = vec4(0.0);
  for (motion = 0; motion < motions; motion++) {
    int row = nearest * motions + motion;
    int layer = int(imageLoad(moves, ivec3(0, row, 0)).x);
    ivec2 own_pixel = pixel_at(quad, pixel);
    vec4 found = seen_light(own_pixel, moved_by(moves_of(quad, row)[pixel], own_pixel), max(layer, 0));
    light += layer < 0 ? vec4(0.0) : share_of_motion(quad, pixel) * found;
  }
  return light;
}
#endif
