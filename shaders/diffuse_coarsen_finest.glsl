// From the 5-point Laplacian to the first coarser operator.
#include "diffuse.glsl"
#include "diffuse_finest.glsl"
#include "diffuse_coarsen.glsl"

void main()
{
  ivec2 p = ivec2(gl_GlobalInvocationID);
  if (!inside(p, coarse)) {
    return;
  }
  float product[25];
  for (int n = 0; n < 25; n++) {
    product[n] = 0.0;
  }
  for (int c = 0; c < 9; c++) {
    ivec2 i = 2 * p + OFFSET(c);
    if (inside(i, size)) {
      float weight = share(i, p, coarse) * scale(i);
      int at = 5 * (c / 3 + 1) + c % 3 + 1;
      // A neighbour beyond the edge has no equation, a fixed one no scale: store_row() leaves both out.
      product[at - 5] -= weight;
      product[at - 1] -= weight;
      product[at + 1] -= weight;
      product[at + 5] -= weight;
      vec2 ends = vec2(equal(i, ivec2(0))) + vec2(equal(i, size - 1));
      product[at] += weight * (4.0 - ends.x - ends.y);
    }
  }
  store_row(p, product);
}
