// Shared by passes over tiles of 8 × 8 or 4 × 4 cells of a grid. Coarse cells lie on the even cells of the finer grid.
layout(local_size_x = 8, local_size_y = 8) in;
uniform sampler2DArray tiles;  // lists of tiles, 256 to a row; a tile is x + 4096 · y of its first cell, in fours
uniform int first, last;  // where the list lies among them
uniform ivec2 size;  // the grid's

// The 3 × 3 cells around one: k = 0 … 8, row by row, itself 4.
#define OFFSET(k) (ivec2((k) % 3, (k) / 3) - 1)

bool inside(ivec2 i, ivec2 grid) {
  return all(greaterThanEqual(i, ivec2(0))) && all(lessThan(i, grid));
}

// The first cell of the list's tile n, or a cell outside the grid behind the end of the list.
ivec2 corner(int n, ivec2 grid) {
  if (n >= last) {
    return grid;
  }
  int tile = int(texelFetch(tiles, ivec3(n & 255, n >> 8, 0), 0).r);
  return 4 * ivec2(tile & 4095, tile >> 12);
}

// The first cell of the tile that invocations (·, y) work on.
ivec2 corner(ivec2 grid) {
  return corner(first + int(gl_GlobalInvocationID.y), grid);
}

// The cell of invocation (x, ·) in its tile, in rows of eight or of four.
#define IN_EIGHTS ivec2(gl_GlobalInvocationID.x & 7u, gl_GlobalInvocationID.x >> 3)
#define IN_FOURS ivec2(gl_GlobalInvocationID.x & 3u, gl_GlobalInvocationID.x >> 2)
