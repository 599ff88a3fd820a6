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

#if MOVED && COMBINE
void fold_frame(int quad) {
  fold_sight(quad, frame);
}
#endif

void expose_frames() {
  for (frame = first; frame < last; frame++) {
#if MOVED && COMBINE
    EACH(start_sight);
#endif
#if MOVED
    for (motion = 0; motion < motions; motion++)
#endif
    {
      EACH(add_frame);
    }
#if MOVED && COMBINE
    EACH(fold_frame);
#endif
  }
}

void main() {
  if (!start_block()) {
    return;
  }
  GO_THROUGH(expose_frames)
  EACH(finish_quad);
}
