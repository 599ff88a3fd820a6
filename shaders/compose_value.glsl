// A pixel's own shutter by value interpolation: q = Σ cᵢ sᵢ/eᵢ, a row of the table per frame that any of them exposes.
#include "compose.glsl"

void main()
{
  if (!start_block()) {
    return;
  }
  for (int frame = first; frame < last; frame++) {
    expose(frame, mixed(0, 1 + frame - first));
  }
  finish();
}
