// A pixel's own shutter by value interpolation: q = Σ cᵢ sᵢ/eᵢ, a row of the table per frame that any of them exposes.
uniform int first, last;
#include "compose.glsl"

int frame;

void add_frame(int quad) {
#if MOVED
  expose(quad, frame, mixed(quad, 0, 1 + (frame - first) * motions + motion));
#else
  expose(quad, frame, mixed(quad, 0, 1 + frame - first));
#endif
}

void main() {
  if (!start_block()) {
    return;
  }
  for (frame = first; frame < last; frame++) {
#if MOVED
    for (motion = 0; motion < motions; motion++)
#endif
    {
      EACH(add_frame);
    }
  }
  EACH(finish_quad);
}
