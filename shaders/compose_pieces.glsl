// A pixel's own shutter by displacement interpolation, exact (paper §3.4.1): its quantile is Σ cᵢ Sᵢ⁻¹, linear
// between the knots of the table; each piece spreads its share evenly over the frames that it passes.
// For few pieces: a frame is fetched again for every piece that touches it.
#include "compose.glsl"

void main()
{
  if (!start_block()) {
    return;
  }
  for (int row = 1; row <= rows; row++) {
    vec4 start = mixed(0, row);
    vec4 end = mixed(GROUPS, row);
    vec4 density = texelFetch(table, ivec3(2 * GROUPS, row, 0), 0).r / max(end - start, 1e-7);
    float until = max(max(end.x, end.y), max(end.z, end.w));
    for (int frame = int(min(min(start.x, start.y), min(start.z, start.w))); float(frame) < until; frame++) {
      expose(frame, max(min(end, float(frame + 1)) - max(start, float(frame)), 0.0) * density);
    }
  }
  finish();
}
