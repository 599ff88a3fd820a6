// The paper's Appendix A as it stands: every Q(τ) by bisection in nine steps, every S⁻¹ by binary search within its
// bounds, S in shared memory. SHUTTERS, LAST (frames of the window), AGGREGATE: pixels along a block that shares q.
// SHARED 0 looks S up in its texture instead, which software renderers are quicker at.
layout(local_size_x = 64) in;
uniform sampler2DArray frames, coefficients, sums;
layout(rgba32f) uniform writeonly image2DArray picture;
uniform ivec2 size;
uniform int top, height, first_layer;
#include "light.glsl"

#if SHARED
shared float accumulation[SHUTTERS][LAST + 1];
#  define S(shutter, time) accumulation[shutter][time]
#else
#  define S(shutter, time) texelFetch(sums, ivec3(time, shutter, 0), 0).r
#endif

float c[SHUTTERS];

void load_accumulations() {
#if SHARED
  int local = int(gl_LocalInvocationIndex);
  for (int entry = local; entry < SHUTTERS * (LAST + 1); entry += 64) {
    int shutter = entry / (LAST + 1);
    accumulation[shutter][entry % (LAST + 1)] = texelFetch(sums, ivec3(entry % (LAST + 1), shutter, 0), 0).r;
  }
  barrier();
#endif
}

void load_coefficients(ivec2 block) {
  for (int i = 0; i < SHUTTERS; i++) {
    c[i] = texelFetch(coefficients, ivec3(block, i / 4), 0)[i % 4];
  }
}

float inverse_accumulation(int i, float z, int low, int high, out int found) {
  while (low < high) {
    int mid = (low + high) / 2;
    if (!(z < S(i, mid))) {
      low = mid + 1;
    }
    else {
      high = mid;
    }
  }
  found = low;
  if (low == 0) {
    return 0.0;
  }
  float above = S(i, low);
  float below = S(i, low - 1);
  return float(low - 1) + (z - below) / (above - below);
}

float inverse_mixed(float z, int lows[SHUTTERS], int highs[SHUTTERS], out int bounds[SHUTTERS]) {
  float result = 0.0;
  for (int i = 0; i < SHUTTERS; i++) {
    result += c[i] * inverse_accumulation(i, z, lows[i], highs[i], bounds[i]);
  }
  return result;
}

float mixed_accumulation(float time, inout int lowest[SHUTTERS]) {
  int lows[SHUTTERS] = lowest;
  int highs[SHUTTERS];
  for (int i = 0; i < SHUTTERS; i++) {
    highs[i] = LAST;
  }
  int bounds[SHUTTERS];
  float z = 0.5;
  float dz = 0.25;
  for (int step = 0; step < 9; step++) {
    if (inverse_mixed(z, lows, highs, bounds) <= time) {
      z += dz;
      lows = bounds;
    }
    else {
      z -= dz;
      highs = bounds;
    }
    dz *= 0.5;
  }
  lowest = bounds;
  return z;
}

vec3 frame_light(ivec2 pixel, int layer) {
  vec3 color = texelFetch(frames, ivec3(pixel, layer), 0).rgb;
#if DECODE
  color = to_linear(color);
#endif
  return color;
}

void main() {
  load_accumulations();
  ivec2 block = ivec2(gl_GlobalInvocationID.xy);
  ivec2 corner = block * AGGREGATE;
  if (corner.x >= size.x || corner.y >= size.y) {
    return;
  }
  load_coefficients(block + ivec2(0, top / AGGREGATE));
  vec3 totals[AGGREGATE * AGGREGATE];
  int lowest[SHUTTERS];
  for (int i = 0; i < SHUTTERS; i++) {
    lowest[i] = 0;
  }
  for (int k = 0; k < AGGREGATE * AGGREGATE; k++) {
    totals[k] = vec3(0.0);
  }
  float before = 0.0;
  for (int time = 1; time <= LAST; time++) {
    float after = mixed_accumulation(float(time), lowest);
    int layer = (first_layer + time - 1) % LAST;
    for (int k = 0; k < AGGREGATE * AGGREGATE; k++) {
      ivec2 pixel = min(corner + ivec2(k % AGGREGATE, k / AGGREGATE), size - 1);
      totals[k] += (after - before) * frame_light(pixel, layer);
    }
    before = after;
  }
  for (int k = 0; k < AGGREGATE * AGGREGATE; k++) {
    ivec2 pixel = corner + ivec2(k % AGGREGATE, k / AGGREGATE);
    if (pixel.x < size.x && pixel.y < size.y) {
#if !DECODE
      totals[k] = to_linear_exact(totals[k]);
#endif
      imageStore(picture, ivec3(pixel.x, height - 1 - top - pixel.y, 0), vec4(totals[k], 1.0));
    }
  }
}
