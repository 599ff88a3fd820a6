// Solves the coarsest grid, of 4 × 4 cells at most, by elimination in one invocation.
void main()
{
  int layer = int(gl_GlobalInvocationID.z);
  if (any(greaterThan(gl_GlobalInvocationID.xy, uvec2(0)))) {
    return;
  }
  int count = size.x * size.y;
  float a[16 * 16];
  vec4 x[16];
  for (int i = 0; i < count; i++) {
    for (int j = 0; j < count; j++) {
      a[16 * i + j] = 0.0;
    }
    ivec2 p = ivec2(i % size.x, i / size.x);
    vec4 before = imageLoad(stencil, ivec3(p, 0));
    vec4 after = imageLoad(stencil, ivec3(p, 1));
    // Entries of cells beyond the edge are zero: added to the cell itself they change nothing.
    for (int k = 0; k < 4; k++) {
      ivec2 q = clamp(p + ivec2(k % 3, k / 3) - 1, ivec2(0), size - 1);
      a[16 * i + q.y * size.x + q.x] += before[k];
      q = clamp(p + ivec2((k + 5) % 3, (k + 5) / 3) - 1, ivec2(0), size - 1);
      a[16 * i + q.y * size.x + q.x] += after[k];
    }
    a[17 * i] += imageLoad(stencil, ivec3(p, 2)).y;
    x[i] = imageLoad(right, ivec3(p, layer));
  }
  for (int k = 0; k < count; k++) {
    for (int i = k + 1; i < count; i++) {
      // Where nothing is to solve there is no pivot.
      float factor = a[17 * k] > 1e-6 ? a[16 * i + k] / a[17 * k] : 0.0;
      for (int j = k; j < count; j++) {
        a[16 * i + j] -= factor * a[16 * k + j];
      }
      x[i] -= factor * x[k];
    }
  }
  for (int k = count - 1; k >= 0; k--) {
    for (int j = k + 1; j < count; j++) {
      x[k] -= a[16 * k + j] * x[j];
    }
    x[k] = a[17 * k] > 1e-6 ? x[k] / a[17 * k] : vec4(0.0);
    imageStore(solution, ivec3(k % size.x, k / size.x, layer), x[k]);
  }
}
