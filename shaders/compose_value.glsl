// A pixel's own shutter by value interpolation: q = Σ cᵢ sᵢ/eᵢ, a row of the table per frame that any of them exposes.
uniform int first, last;
#include "compose.glsl"

int frame;

void add_frame(int quad) {
  expose(quad, frame, mixed(quad, 0, 1 + (frame - first) * motions + motion));
}

void fold_frame(int quad) {
  fold_sight(quad, frame);
}

void expose_frames() {
  for (frame = first; frame < last; frame++) {
    EACH(start_sight);
#if MOVED
    for (motion = 0; motion < motions; motion++)
#endif
    {
      EACH(add_frame);
    }
    EACH(fold_frame);
  }
}
#include "blocks.glsl"
