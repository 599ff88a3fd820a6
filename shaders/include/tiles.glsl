// What passes over the tiles of a grid share, 8 × 8 cells or 4 × 4. Coarse cells lie on the even cells of the finer grid.
layout(local_size_x = 8, local_size_y = 8) in;
uniform sampler2DArray tiles;  // lists, 256 to a row, each tile as x + 4096 · y of its first cell, in fours
uniform int first, last;  // the list's place among them
uniform ivec2 size;  // of the grid

// Cells around one: k = 0 … 8, row by row, itself 4.
#define OFFSET(k) (ivec2((k) % 3, (k) / 3) - 1)

// Whether a cell lies in a grid of that size.
bool inside(ivec2 i, ivec2 grid) {
  return all(greaterThanEqual(i, ivec2(0))) && all(lessThan(i, grid));
}

// The first cell of entry n of the list, or one beyond the grid where the list has ended.
ivec2 corner(int n, ivec2 grid) {
  if (n >= last) {
    return grid;
  }
  int tile = int(texelFetch(tiles, ivec3(n & 255, n >> 8, 0), 0).r);
  return 4 * ivec2(tile & 4095, tile >> 12);
}

// Of the tile of invocations (·, y).
ivec2 corner(ivec2 grid) {
  return corner(first + int(gl_GlobalInvocationID.y), grid);
}

// The place of invocation (x, ·) in rows of eight, or of four.
#define IN_EIGHTS ivec2(gl_GlobalInvocationID.x & 7u, gl_GlobalInvocationID.x >> 3)
#define IN_FOURS ivec2(gl_GlobalInvocationID.x & 3u, gl_GlobalInvocationID.x >> 2)
