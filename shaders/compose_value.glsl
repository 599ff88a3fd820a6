// A pixel's own shutter by value interpolation: q = Σ cᵢ sᵢ/eᵢ, a row of the table per frame.
#include "compose.glsl"

void main()
{
  pixel = ivec2(gl_GlobalInvocationID.xy);
  if (pixel.x >= size.x || pixel.y >= size.y) {
    return;
  }
  load_coefficients();
  for (int frame = 0; frame < window; frame++) {
    expose(frame, mixed(0, 1, frame + 1));
  }
  finish();
}
