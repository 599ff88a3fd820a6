// Combines frames other than by averaging; core/pixels/compositor.py is the reference. COMBINE: 1 lightest, 2 darkest, 3
// median. For 1 and 2, `total` holds the best light so far and the largest wₖ aₖ; `share` the largest wₖ, a frame's weight
// times `gain`. BY_LUMINANCE: all channels of a pixel come from one frame. THRESHOLD: light below (darkest: above)
// `threshold.x`, with a soft edge of ± `threshold.y`, leaves no trail; the window's frame `shown` always counts.
#if COMBINE == 3
// Finds the median by levels, which rise with the samples. Each scan through the frames narrows the range of levels to a
// quarter, by the weight below three thresholds. The last scan finds the samples at that level, and the next ones above.
// LEVELS_OF: 0 for 8-bit samples, 1 for 16-bit samples, 2 for light.
#  define SCANS (LEVELS_OF == 0 ? 4 : 9)
#  define WIDEST (LEVELS_OF == 0 ? 64.0 : 65536.0)
#  define HIGHEST (LEVELS_OF == 0 ? 255.0 : LEVELS_OF == 1 ? 65535.0 : 262143.0)
#  define STEPS 3
// Within this of the middle, both neighbours count: MIDDLE of core/pixels/compositor.py.
const float NEAR_MIDDLE = 1.0 / 8192.0;
int scan = 0;
float width_of_step = WIDEST;
vec3 base[4];  // of each pixel, the lowest level that the median may have
vec3 bounds[4 * STEPS];  // the thresholds, between levels
vec3 below[4 * STEPS];  // the weight below each threshold
vec3 until[4];  // in the last scan, the weight at the median's level or below
vec3 lower[4];
vec3 upper[4];
vec4 covered = vec4(0.0);  // each pixel's Σ qₖ aₖ

// A frame's sample and alpha; the level that is compared; the sample's light, which rises with it.
#  if LEVELS_OF == 2
vec4 sample_at(ivec2 place, int slot) {
  vec4 light = frame_light(place, slot);
  return vec4(straight(light), light.a);
}

vec3 level_of(vec3 value) {
  vec3 root = sign(value) * sqrt(sqrt(abs(value)));  // light of wide gamuts may be negative
  return 0.5 + 0.5 * root / (1.0 + abs(root));
}
#    define light_of(value) (value)
#  else
#    define sample_at(place, slot) texelFetch(frames, ivec3(place, slot), 0)
#    define level_of(value) (value)
#    define light_of(value) decoded(value)
#  endif

void start_median() {
  for (int pixel = 0; pixel < 4; pixel++) {
    base[pixel] = vec3(0.0);
    until[pixel] = vec3(0.0);
    lower[pixel] = vec3(1e30);
    upper[pixel] = vec3(1e30);
  }
}

void start_scan() {
  for (int pixel = 0; pixel < 4; pixel++) {
    for (int k = 0; k < STEPS; k++) {
      // The last scan's thresholds lie below and above the median's level.
      float up = scan < SCANS ? float(k + 1) * width_of_step : float(min(k, 1));
      bounds[pixel * STEPS + k] = (base[pixel] + up - 0.5) / HIGHEST;
      below[pixel * STEPS + k] = vec3(0.0);
    }
  }
}

void count_sample(int pixel, vec4 found, float weight) {
#  if OPAQUE
  float own = weight;
#  else
  float own = weight * found.a;
#  endif
  vec3 level = level_of(found.rgb);
  vec3 counted = vec3(own);
  if (scan < SCANS) {
    for (int k = 0; k < STEPS; k++) {
      below[pixel * STEPS + k] += mix(vec3(0.0), counted, lessThan(level, bounds[pixel * STEPS + k]));
    }
    covered[pixel] += scan == 0 ? own : 0.0;
    share[0][pixel] += scan == 0 ? weight : 0.0;
  } else {
    vec3 value = own > 0.0 ? found.rgb : vec3(1e30);
    bvec3 is_lower = lessThan(level, bounds[pixel * STEPS]);
    bvec3 is_first = lessThan(level, bounds[pixel * STEPS + 1]);
    until[pixel] += mix(vec3(0.0), counted, is_first);
    lower[pixel] = min(lower[pixel], mix(value, vec3(1e30), is_lower));
    upper[pixel] = min(upper[pixel], mix(value, vec3(1e30), is_first));
  }
}

void end_scan() {
  if (scan < SCANS) {
    for (int pixel = 0; pixel < 4; pixel++) {
      vec3 steps = vec3(0.0);
      for (int k = 0; k < STEPS; k++) {
        steps += vec3(lessThan(below[pixel * STEPS + k], vec3((0.5 - NEAR_MIDDLE) * covered[pixel])));
      }
      base[pixel] += width_of_step * steps;
    }
    width_of_step /= 4.0;
  }
}

vec4 median_of(int pixel) {
  float cover = covered[pixel] / max(share[0][pixel], 1e-30);
  vec3 part = clamp((until[pixel] / max(covered[pixel], 1e-30) - (0.5 - NEAR_MIDDLE)) / (2.0 * NEAR_MIDDLE), 0.0, 1.0);
  vec3 least = light_of(lower[pixel]);
  vec3 next = light_of(min(upper[pixel], 1e29));
  part = mix(part, vec3(1.0), greaterThan(upper[pixel], vec3(1e29)));
  vec3 middle = mix(part * least + (1.0 - part) * next, least, equal(part, vec3(1.0)));
  return vec4(covered[pixel] > 0.0 ? middle * cover : vec3(0.0), cover);
}
#else
const vec3 LUMINANCE = vec3(0.2126, 0.7152, 0.0722);
// How much of a light leaves a trail, from 0 to 1.
#  if THRESHOLD
uniform vec2 threshold;
uniform int shown;

float passed(vec4 light) {
  vec3 own = straight(light);
  float luminance = dot(ENCODED != 0 ? to_linear_exact(own) : own, LUMINANCE);
  float t = clamp((luminance - threshold.x + threshold.y) / (2.0 * threshold.y), 0.0, 1.0);
  t = t * t * (3.0 - 2.0 * t);
  return COMBINE == 2 ? 1.0 - t : t;
}
#  else
#    define passed(light) 1.0
#  endif

vec3 better(vec3 best, vec3 other) {
#  if BY_LUMINANCE
  return dot(other, LUMINANCE) > dot(best, LUMINANCE) ? other : best;
#  else
  return max(best, other);
#  endif
}

// Folds a frame's light into `total`. weight: from 0 to 1.
void fold(int quad, int pixel, vec4 light, float weight) {
#  if COMBINE == 2
  vec3 dark = vec3(light.a) - light.rgb;
  vec4 value = vec4(weight * max(dark, 0.0) + min(dark, 0.0), weight * light.a);
#  else
  vec4 value = weight * light;
#  endif
  value.rgb = weight > 0.0 ? value.rgb : vec3(-1e30);
  vec4 best = total[quad][pixel];
  total[quad][pixel] = vec4(better(best.rgb, value.rgb), max(best.a, value.a));
}

// The folded light, which other passes go on with.
vec4 folded(int quad, int pixel) {
  vec4 best = total[quad][pixel];
  return vec4(best.rgb, best.a / max(share[quad][pixel], 1e-30));
}

vec4 with_others(vec4 color, vec4 other) {
  return vec4(better(color.rgb, other.rgb), max(color.a, other.a));
}

vec4 finished_fold(vec4 color) {
  vec3 best = mix(color.rgb, vec3(0.0), lessThan(color.rgb, vec3(-1e29)));
  return vec4(COMBINE == 2 ? color.a - best : best, color.a);
}
#endif
