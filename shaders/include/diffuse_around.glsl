// The coarser grid's four cells around the 2 × 2 cells from p on, row by row.
mat4 around(ivec3 p)
{
  ivec2 a = p.xy / 2;
  ivec2 b = min(a + 1, coarse - 1);
  return mat4(imageLoad(coarser, ivec3(a, p.z)), imageLoad(coarser, ivec3(b.x, a.y, p.z)),
              imageLoad(coarser, ivec3(a.x, b.y, p.z)), imageLoad(coarser, ivec3(b, p.z)));
}
