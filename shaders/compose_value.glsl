// Composes by value interpolation: q = Σ cᵢ sᵢ/eᵢ. The table has a row for each frame that any shutter exposes.
uniform int first, last;
#include "compose.glsl"

int frame;
#define ADD(quad) expose(quad, frame, mixed(quad, 0, 1 + (frame - first) * motions + motion))
#define FOLD(quad) fold_sight(quad, frame)

void expose_frames() {
  for (frame = first; frame < last; frame++) {
    EACH(start_sight);
#if MOVED
    for (motion = 0; motion < motions; motion++)
#endif
    {
      EACH(ADD);
    }
    EACH(FOLD);
  }
}
#include "blocks.glsl"
