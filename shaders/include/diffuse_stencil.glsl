// What a coarser grid's equation takes of the cells around p, by the operator's entries; NEAR(x, y) is the value there.
// Entries of cells beyond the edge are zero.
vec4 taken_around(ivec3 p)
{
  vec4 before = imageLoad(stencil, ivec3(p.xy, 0));
  vec4 after = imageLoad(stencil, ivec3(p.xy, 1));
  vec4 total = before.x * NEAR(-1, -1) + before.y * NEAR(0, -1) + before.z * NEAR(1, -1) + before.w * NEAR(-1, 0);
  return total + after.x * NEAR(1, 0) + after.y * NEAR(-1, 1) + after.z * NEAR(0, 1) + after.w * NEAR(1, 1);
}
