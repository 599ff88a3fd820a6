// What every pixel takes of the coarse cells around it, from the 5-point Laplacian.
#include "diffuse.glsl"

bool is_free(ivec2 i)
{
  return inside(i, size) && imageLoad(labels, ivec3(i, 0)).r == 0u;
}

void couplings(ivec2 i, out float c[9], out float diagonal)
{
  bool live = is_free(i);
  diagonal = 0.0;
  for (int k = 0; k < 9; k++) {
    ivec2 j = i + OFFSET(k);
    bool counts = live && k % 2 == 1 && inside(j, size);
    diagonal += counts ? 1.0 : 0.0;
    c[k] = counts && is_free(j) ? 1.0 : 0.0;
  }
}

#include "diffuse_weights.glsl"
