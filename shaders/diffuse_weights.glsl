// What every cell of a coarser grid takes of the next grid's cells around it, from its own operator.
#include "diffuse.glsl"

void couplings(ivec2 i, out float c[9], out float diagonal)
{
  diagonal = 0.0;
  for (int k = 0; k < 9; k++) {
    c[k] = 0.0;
  }
  if (inside(i, size)) {
    vec4 before = imageLoad(stencil, ivec3(i, 0));
    vec4 after = imageLoad(stencil, ivec3(i, 1));
    diagonal = imageLoad(stencil, ivec3(i, 2)).y;
    for (int k = 0; k < 4; k++) {
      c[k] = -before[k];
      c[k + 5] = -after[k];
    }
  }
}

bool is_free(ivec2 i)
{
  return inside(i, size) && imageLoad(stencil, ivec3(i, 2)).x > 0.0;
}

#include "diffuse_weights.glsl"
