// From the 5-point Laplacian to the first coarser operator.
#include "diffuse.glsl"

float product[25];

void add_row(ivec2 i, int at, float weight)
{
  // A neighbour beyond the edge has no equation, a fixed one no weights: the caller leaves both out.
  product[at - 5] -= weight;
  product[at - 1] -= weight;
  product[at + 1] -= weight;
  product[at + 5] -= weight;
  vec2 ends = vec2(equal(i, ivec2(0))) + vec2(equal(i, size - 1));
  product[at] += weight * (4.0 - ends.x - ends.y);
}

#include "diffuse_coarsen.glsl"
