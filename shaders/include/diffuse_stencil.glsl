// A coarser grid's operator. Layers of its texture: entries 0 … 3; entries 5 … 8; 1/diagonal, scale, diagonal.
float scale(ivec2 i)
{
  return texelFetch(stencil, ivec3(i, 2), 0).y;
}

// What the cells around p take away from its equation, given LOAD(p). Entries of cells beyond the edge are zero.
#define NEAR(x, y) LOAD(ivec3(clamp(p.xy + ivec2(x, y), ivec2(0), size - 1), p.z))
#define AROUND(before, after) \
  (before.x * NEAR(-1, -1) + before.y * NEAR(0, -1) + before.z * NEAR(1, -1) + before.w * NEAR(-1, 0) + \
   after.x * NEAR(1, 0) + after.y * NEAR(-1, 1) + after.z * NEAR(0, 1) + after.w * NEAR(1, 1))
