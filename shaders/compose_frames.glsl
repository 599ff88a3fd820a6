// A pixel's own shutter by displacement interpolation, exact (paper §3.4.1): its quantile is Σ cᵢ Sᵢ⁻¹, linear
// between the knots of the table. A frame's weight is Q at its end less Q at its start.
// For many pieces: every frame is fetched once. Pieces that end before in every pixel of the block are summed for all of
// them; only those that a pixel may be inside of are looked at pixel by pixel, about one to a frame.
#include "compose.glsl"

vec4 middle[GROUPS];  // of the block's coefficients
float reach;  // how far they lie from it at most: half the sum of what they differ by

void find_middle()
{
  vec4 apart = vec4(0.0);
  for (int g = 0; g < GROUPS; g++) {
    middle[g] = c[g] * vec4(0.25);
    for (int i = 0; i < 4; i++) {
      apart[i] += dot(abs(c[g][i] - middle[g]), vec4(0.5));
    }
  }
  reach = max(max(apart.x, apart.y), max(apart.z, apart.w));
}

// The middle's quantile in the table's row, at the piece's start (column 0) or end (column GROUPS).
float middle_time(int column, int row)
{
  float time = 0.0;
  for (int g = 0; g < GROUPS; g++) {
    time += dot(middle[g], texelFetch(table, ivec3(column + g, row, 0), 0));
  }
  return time;
}

// dz, and the time by which the shutters differ at most: no pixel is further from the middle than `reach` times that.
vec2 extent_of(int row)
{
  return texelFetch(table, ivec3(2 * GROUPS, row, 0), 0).rg;
}

void main()
{
  if (!start_block()) {
    return;
  }
  find_middle();
  vec4 before = vec4(0.0);
  float passed = 0.0;
  int row = 1;
  for (int frame = first; frame < last; frame++) {
    float boundary = float(frame + 1);
    for (; row <= rows; row++) {
      vec2 extent = extent_of(row);
      if (middle_time(GROUPS, row) + reach * extent.y > boundary) {
        break;
      }
      passed += extent.x;
    }
    vec4 after = vec4(passed);
    for (int inside = row; inside <= rows; inside++) {
      vec2 extent = extent_of(inside);
      if (middle_time(0, inside) - reach * extent.y >= boundary) {
        break;
      }
      vec4 start = mixed(0, inside);
      after += extent.x * clamp((boundary - start) / max(mixed(GROUPS, inside) - start, 1e-7), 0.0, 1.0);
    }
    expose(frame, after - before);
    before = after;
  }
  finish();
}
