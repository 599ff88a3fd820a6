// Solves the coarsest grid (at most SOLVED × SOLVED cells) by elimination (LDLᵀ), in one invocation: Blender's Python API
// has no shared memory. Cells are numbered along the shorter side, so that a cell is coupled to at most BAND − 1 before it.
// rows[BAND · i + d] of the symmetric matrix couples cell i to cell i − d; d = 0 becomes 1 / pivot.
layout(local_size_x = 1) in;
layout(rgba32f) uniform readonly image2DArray stencil, right;  // as in multigrid.glsl
layout(rgba32f) uniform writeonly image2DArray solution;
uniform ivec2 size;
#define CELLS (SOLVED * SOLVED)
#define BAND (SOLVED + 2)

float rows[CELLS * BAND];
vec4 x[CELLS];

ivec2 cell(int i) {
  return size.x > size.y ? ivec2(i / size.y, i % size.y) : ivec2(i % size.x, i / size.x);
}

void tie(int i, ivec2 p, float value) {
  int number = size.x > size.y ? p.x * size.y + p.y : p.y * size.x + p.x;
  if (number < i && all(greaterThanEqual(p, ivec2(0))) && all(lessThan(p, size))) {
    rows[BAND * i + i - number] = value;
  }
}

void load_row(int i, int layer) {
  ivec2 p = cell(i);
  for (int k = 1; k < BAND; k++) {
    rows[BAND * i + k] = 0.0;
  }
  rows[BAND * i] = imageLoad(stencil, ivec3(p, 2)).y;
  vec4 before = imageLoad(stencil, ivec3(p, 0));
  vec4 after = imageLoad(stencil, ivec3(p, 1));
  for (int k = 0; k < 4; k++) {
    tie(i, p + ivec2(k % 3 - 1, k / 3 - 1), before[k]);
  }
  tie(i, p + ivec2(-1, 1), after.y);
  x[i] = imageLoad(right, ivec3(p, layer));
}

void main() {
  int layer = int(gl_GlobalInvocationID.z);
  int count = size.x * size.y;
  int reach = min(size.x, size.y) + 1;  // the most that the numbers of coupled cells differ by
  for (int i = 0; i < count; i++) {
    load_row(i, layer);
  }
  for (int k = 0; k < count; k++) {
    // A fixed cell has no pivot.
    float pivot = rows[BAND * k];
    rows[BAND * k] = pivot > 1e-6 ? 1.0 / pivot : 0.0;
    for (int i = 1; i <= min(reach, count - 1 - k); i++) {
      float factor = rows[BAND * k] * rows[BAND * (k + i) + i];
      for (int j = 1; j <= i; j++) {
        rows[BAND * (k + i) + i - j] -= factor * rows[BAND * (k + j) + j];
      }
      x[k + i] -= factor * x[k];
    }
  }
  for (int k = count - 1; k >= 0; k--) {
    for (int i = 1; i <= min(reach, count - 1 - k); i++) {
      x[k] -= rows[BAND * (k + i) + i] * x[k + i];
    }
    x[k] *= rows[BAND * k];
    imageStore(solution, ivec3(cell(k), layer), x[k]);
  }
}
