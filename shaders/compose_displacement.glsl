// A pixel's own shutter by displacement interpolation, exact (paper §3.4.1): its quantile is Σ cᵢ Sᵢ⁻¹, linear
// between the knots of the table. Knots and frames are walked together; each frame is fetched once.
#include "compose.glsl"

void main()
{
  pixel = ivec2(gl_GlobalInvocationID.xy);
  if (pixel.x >= size.x || pixel.y >= size.y) {
    return;
  }
  load_coefficients();
  int frame = 0;
  float weight = 0.0;
  for (int row = 1; row <= rows; row++) {
    float time = mixed(0, 2, row);
    float end = mixed(1, 2, row);
    float density = texelFetch(table, ivec3(2 * groups, row, 0), 0).r / max(end - time, 1e-7);
    for (int next = int(time); time < end && next < window; next++) {
      float step_end = min(end, float(next + 1));
      if (next != frame) {
        expose(frame, weight);
        frame = next;
        weight = 0.0;
      }
      weight += (step_end - time) * density;
      time = step_end;
    }
  }
  expose(frame, weight);
  finish();
}
