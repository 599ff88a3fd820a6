// A pixel's own shutter by value interpolation: q = Σ cᵢ sᵢ/eᵢ, a row of the table per frame that any of them exposes.
#include "compose.glsl"

void main()
{
  pixel = ivec2(gl_GlobalInvocationID.xy);
  if (pixel.x >= size.x || pixel.y >= size.y) {
    return;
  }
  load_coefficients();
  for (int row = 1; row <= rows; row++) {
    expose(first + row - 1, mixed(0, 1, row));
  }
  finish();
}
