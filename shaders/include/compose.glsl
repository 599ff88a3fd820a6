// Shared by the passes that compose: a block's coefficients, the sums over its frames, and the finished picture. An
// invocation composes QUADS of four pixels above one another, which share each look-up in the table. A quad is a matrix
// with a column for each pixel. EACH calls a function for every quad: a loop would move the arrays that it indexes to
// memory. Software renderers run both sides of a branch, so costly code is in loops or behind macros.
// table: row 0 has the gains, the others knots or bars, four shutters per texel. Frame k of the window is frame `origin`
// + k · `direction` of the shot's `count`. frames: source frame i is in layer i mod `layers`. SUMS: running sums instead,
// from position `lowest` on. MOVED: moved.glsl. COMBINE: combine.glsl. VALUE: value interpolation. For other macros see
// compute/composition_passes.py.
layout(rgba32f) uniform readonly image2DArray table;
uniform ivec2 size;
uniform int top, block_bits;
#if MOVED
uniform sampler2DArray coefficients;  // no image: Vulkan guarantees only the four that this pass has
#else
layout(rgba32f) uniform readonly image2DArray coefficients;
uniform int origin, direction, layers, lowest, lowest_layer;
#  if !SUMS || EDGES == 2
uniform int count;
#  endif
#endif
#if SUMS
layout(STORED) uniform readonly uimage2DArray sums;
uniform int held;
uniform float unit;
#elif !PACKED
uniform sampler2DArray frames;
#endif

#include "light.glsl"
#if UNFINISHED
layout(rgba32f) uniform writeonly image2DArray picture;
#else
#  include "finish.glsl"
#endif
#if SUMS
#  include "sums.glsl"
#endif

#if QUADS == 4
#  define EACH(does) does(0); does(1); does(2); does(3)
#else
#  define EACH(does) does(0)
#endif

ivec2 corner;
mat4 c[QUADS * GROUPS];
#if SUMS
SUM sum_before[4 * QUADS];  // each pixel's sum at the frame's start
LIGHT total[4 * QUADS];
#else
mat4 total[QUADS];
#endif
vec4 share[QUADS];  // the part of the exposure that fell on frames that exist
vec4 centre[QUADS];  // the exposure's mean time, with missing frames
#if COMBINE == 1 || COMBINE == 2
vec4 gain[QUADS];  // how much a frame's weight counts (combine.glsl)
#endif

// A pixel of a quad. Pixels beyond the picture's edge repeat the last one.
ivec2 pixel_at(int quad, int pixel) {
  return min(corner + ivec2(0, 4 * quad + pixel), size - 1);
}

vec4 coefficients_at(ivec2 pixel, int group) {
  ivec3 place = ivec3((pixel + ivec2(0, top)) >> block_bits, group);
#if MOVED
  vec4 found = max(texelFetch(coefficients, place, 0), 0.0);
  // Tells the compiler which ones are zero.
  return found * vec4(lessThan(ivec4(0, 1, 2, 3), ivec4(SHUTTERS - 4 * group)));
#else
  return max(imageLoad(coefficients, place), 0.0);
#endif
}

#if SUMS
// The layer of the sum at a position, or at the nearest one that is held.
int layer_at(int position) {
  int layer = clamp(position - lowest, 0, held) + lowest_layer;
  return layer < layers ? layer : layer - layers;
}

// The layer of the sum at the start of a frame of the window.
int start_of(int frame) {
  return layer_at(origin + direction * frame + (direction < 0 ? 1 : 0));
}

LIGHT light_between(SUM start, SUM end) {
  return unpacked_light(direction < 0 ? minus(start, end) : minus(end, start));
}

void start_light(int quad) {
  int layer = start_of(first);
  for (int pixel = 0; pixel < 4; pixel++) {
    sum_before[4 * quad + pixel] = sum_at(place_of_sums(pixel_at(quad, pixel)), layer);
    total[4 * quad + pixel] = LIGHT(0.0);
  }
}
#else
void start_light(int quad) {
#if COMBINE == 1 || COMBINE == 2
  vec4 none = vec4(vec3(-1e30), 0.0);
  total[quad] = mat4(none, none, none, none);
#else
  total[quad] = mat4(0.0);
#endif
}
#endif

// Σ cᵢ tableᵢ in a row of the table, from a column on.
vec4 mixed(int quad, int column, int row) {
  vec4 sum = vec4(0.0);
  for (int g = 0; g < GROUPS; g++) {
    sum += imageLoad(table, ivec3(column + g, row, 0)) * c[quad * GROUPS + g];
  }
  return sum;
}

void start_quad(int quad) {
  vec4 sum = vec4(0.0);
  for (int g = 0; g < GROUPS; g++) {
    mat4 loaded = mat4(coefficients_at(pixel_at(quad, 0), g),
                       coefficients_at(pixel_at(quad, 1), g),
                       coefficients_at(pixel_at(quad, 2), g),
                       coefficients_at(pixel_at(quad, 3), g));
    sum += vec4(1.0) * loaded;
    c[quad * GROUPS + g] = loaded;
  }
  for (int g = 0; g < GROUPS; g++) {
    mat4 loaded = c[quad * GROUPS + g];
    c[quad * GROUPS + g] = mat4(loaded[0] / sum.x, loaded[1] / sum.y, loaded[2] / sum.z, loaded[3] / sum.w);
  }
  share[quad] = vec4(0.0);
  centre[quad] = vec4(0.0);
  start_light(quad);
#if COMBINE == 1 || COMBINE == 2
#  if VALUE
  gain[quad] = vec4(1.0);
  centre[quad] = mixed(quad, 0, 0);  // the sum of these weights is not 1
#  else
  gain[quad] = mixed(quad, 0, 0);
#  endif
#endif
}

// Starts the block. False: it lies outside the picture.
bool start_block() {
  corner = ivec2(gl_GlobalInvocationID.xy) * ivec2(1, 4 * QUADS);
  EACH(start_quad);
  return corner.x < size.x && corner.y < size.y;
}

#if !SUMS
#  if !PACKED
// The frame's light as it is summed, premultiplied.
vec4 frame_light(ivec2 place, int slot) {
  vec4 color = texelFetch(frames, ivec3(place, slot), 0);
#if PREMULTIPLIED
#  if DECODE == 1
  color.rgb = to_linear_of_any(straight(color)) * cover(color);
#  elif DECODE == 2
  color.rgb = to_encoded(straight(color)) * color.a;
#  endif
#elif OPAQUE
  return vec4(decoded(color.rgb), 1.0);
#else
  color.rgb = decoded(color.rgb) * color.a;
#endif
  return color;
}
#  endif

#  if !MOVED
// The layer of a frame of the window, or of the shot's nearest end.
int layer_of(int frame) {
  int index = origin + direction * frame;
#if EDGES == 1  // mirror
  int period = max(2 * (count - 1), 1);
  index = (index + 512 * period) % period;  // of a negative number, % is undefined
  index = min(index, period - index);
#endif
  // A division costs more than the fetch.
  int layer = clamp(index, 0, count - 1) - lowest + lowest_layer;
  return layer < layers ? layer : layer - layers;
}
#  endif
#endif

#if COMBINE
#  include "combine.glsl"
#endif

int motion = 0;
#if !MOVED
const int motions = 1;
#endif
#if !MOVED || !COMBINE
void start_sight(int quad) {}
void fold_sight(int quad, int frame) {}
#endif

#if MOVED
#  include "moved.glsl"
#else
// Adds a frame. Frames come in order, so with SUMS the sum at its start is the last frame's end.
void expose(int quad, int frame, vec4 weight) {
#if EDGES == 2  // shorten
#  if COMBINE == 3
  centre[quad] += scan == 0 ? weight * (float(frame) + 0.5) : vec4(0.0);
#  elif !COMBINE || !VALUE
  centre[quad] += weight * (float(frame) + 0.5);
#  endif
  int index = origin + direction * frame;
  weight = index >= 0 && index < count ? weight : vec4(0.0);
#endif
#if SUMS
  share[quad] += weight;
  int end = start_of(frame + 1);
  for (int pixel = 0; pixel < 4; pixel++) {
    SUM sum = sum_at(place_of_sums(pixel_at(quad, pixel)), end);
    total[4 * quad + pixel] += weight[pixel] * light_between(sum_before[4 * quad + pixel], sum);
    sum_before[4 * quad + pixel] = sum;
  }
#else
  int layer = layer_of(frame);
#  if COMBINE == 3
  for (int pixel = 0; pixel < 4; pixel++) {
    count_sample(pixel, sample_at(pixel_at(quad, pixel), layer), weight[pixel]);
  }
#  elif COMBINE
  weight *= gain[quad];
  for (int pixel = 0; pixel < 4; pixel++) {
    vec4 light = frame_light(pixel_at(quad, pixel), layer);
    fold(quad, pixel, light, weight[pixel] * passed(light));
#    if THRESHOLD
    fold(quad, pixel, light, frame == shown ? 1.0 : 0.0);
#    endif
  }
#    if THRESHOLD
  share[quad] = frame == shown ? vec4(1.0) : share[quad];
#    endif
  share[quad] = max(share[quad], weight);
#  else
  share[quad] += weight;
  total[quad] += mat4(weight.x * frame_light(pixel_at(quad, 0), layer),
                      weight.y * frame_light(pixel_at(quad, 1), layer),
                      weight.z * frame_light(pixel_at(quad, 2), layer),
                      weight.w * frame_light(pixel_at(quad, 3), layer));
#  endif
#endif
}
#endif

#if !MOVED && EDGES == 2
// The light of the existing frame that is nearest to a frame of the window.
vec4 nearest_light(int quad, int pixel, int frame) {
#if SUMS
  int position = clamp(origin + direction * frame, 0, count - 1);
  ivec3 place = place_of_sums(pixel_at(quad, pixel));
  SUM sum = minus(sum_at(place, layer_at(position + 1)), sum_at(place, layer_at(position)));
  return covered(unit * unpacked_light(sum));
#else
  return frame_light(pixel_at(quad, pixel), layer_of(frame));
#endif
}
#endif

void store(int quad, int pixel, float brightness) {
  ivec2 at = corner + ivec2(0, 4 * quad + pixel);
  if (at.y >= size.y) {
    return;
  }
#if SUMS && COVER
  vec4 color = covered(unit * total[4 * quad + pixel] / max(share[quad][pixel], 1e-6));
#elif COMBINE == 3
  vec4 color = median_of(pixel);
#elif COMBINE
  vec4 color = folded(quad, pixel);
#elif SUMS
  vec4 color = vec4(unit * total[4 * quad + pixel], share[quad][pixel]) / max(share[quad][pixel], 1e-6);
#else
  vec4 color = total[quad][pixel] / max(share[quad][pixel], 1e-6);
#endif
#if EDGES == 2
  // Where no exposed frame exists, the nearest one does (core/pixels/compositor.py has the same 1e-3).
  for (int once = share[quad][pixel] > 1e-6 ? 1 : 0; once < 1; once++) {
    color = nearest_light(quad, pixel, int(centre[quad][pixel] - 1e-3));
  }
#endif
#if CONTINUED && COMBINE
  color = share[quad][pixel] > 1e-6 ? with_others(color, texelFetch(summed, ivec3(at, 0), 0))
                                    : color + texelFetch(summed, ivec3(at, 0), 0);
#elif CONTINUED
  color += texelFetch(summed, ivec3(at, 0), 0);
#endif
#if !UNFINISHED && COMBINE == 1 || !UNFINISHED && COMBINE == 2
  color = share[quad][pixel] > 1e-6 ? finished_fold(color) : color;
#endif
#if UNFINISHED
  imageStore(picture, ivec3(at, 0), color);
#else
#  if ENCODED
  color.rgb = to_linear_exact(straight(color)) * color.a;
#  endif
#  if !COMBINE
  color.rgb *= brightness;
#  endif
  finish(at + ivec2(0, top), color);
#endif
}

void finish_quad(int quad) {
  vec4 brightness = mixed(quad, 0, 0);
  store(quad, 0, brightness.x);
  store(quad, 1, brightness.y);
  store(quad, 2, brightness.z);
  store(quad, 3, brightness.w);
}
