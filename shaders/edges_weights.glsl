// What every pixel takes of the coarse cells around it, from its links.
#include "diffuse.glsl"

vec4 links_of(ivec2 i)
{
  return inside(i, size) ? imageLoad(links, ivec3(i, 0)) : vec4(0.0);
}

bool is_free(ivec2 i)
{
  return dot(links_of(i), vec4(1.0)) > 0.0;
}

void couplings(ivec2 i, out float c[9], out float diagonal)
{
  vec4 tied = links_of(i);
  diagonal = dot(tied, vec4(1.0));
  for (int k = 0; k < 9; k++) {
    c[k] = k % 2 == 1 && is_free(i + OFFSET(k)) ? tied[k / 2] : 0.0;
  }
}

#include "diffuse_weights.glsl"
