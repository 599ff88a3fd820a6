// From the pixels' links to the first coarser operator.
#include "diffuse.glsl"

float product[25];

void add_row(ivec2 i, int at, float weight)
{
  // A neighbour beyond the edge has no link, a fixed one no weights: the caller leaves it out.
  vec4 tied = weight * imageLoad(links, ivec3(i, 0));
  product[at - 5] -= tied.x;
  product[at - 1] -= tied.y;
  product[at + 1] -= tied.z;
  product[at + 5] -= tied.w;
  product[at] += dot(tied, vec4(1.0));
}

#include "diffuse_coarsen.glsl"
