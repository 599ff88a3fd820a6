// A pixel's own shutter by displacement interpolation, exact (paper §3.4.1): its quantile is Σ cᵢ Sᵢ⁻¹, linear
// between the knots of the table; each piece spreads its share evenly over the frames that it passes.
#include "compose.glsl"

void main()
{
  pixel = ivec2(gl_GlobalInvocationID.xy);
  if (pixel.x >= size.x || pixel.y >= size.y) {
    return;
  }
  load_coefficients();
  for (int row = 1; row <= rows; row++) {
    float start = mixed(0, 2, row);
    float end = mixed(1, 2, row);
    float density = texelFetch(table, ivec3(2 * GROUPS, row, 0), 0).r / max(end - start, 1e-7);
    for (int frame = int(start); float(frame) < end; frame++) {
      expose(frame, (min(end, float(frame + 1)) - max(start, float(frame))) * density);
    }
  }
  finish();
}
