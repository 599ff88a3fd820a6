// What the passes of a multigrid share. Coarse cells lie on the even cells of the finer grid.
// Work is done tile by tile, of 8 × 8 cells or 4 × 4: `tiles` lists a grid's, 256 to a row, each as x + 4096 · y of its
// first cell, in fours.
#include "inside.glsl"

// Cells around one: k = 0 … 8, row by row, itself 4.
#define OFFSET(k) (ivec2((k) % 3, (k) / 3) - 1)
// And two cells around it: n = 0 … 24, itself 12; which of them cell k is.
#define OFFSET_OF_25(n) (ivec2((n) % 5, (n) / 5) - 2)
#define AMONG_25(k) (5 * ((k) / 3 + 1) + (k) % 3 + 1)

// Calls a function for every cell of 3 × 3, or of 5 × 5: where a compiler leaves a loop, arrays that it indexes go through
// memory, and a software renderer takes many times as long.
#define EACH_OF_9(does) \
  does(0); \
  does(1); \
  does(2); \
  does(3); \
  does(4); \
  does(5); \
  does(6); \
  does(7); \
  does(8)
#define EACH_OF_25(does) \
  EACH_OF_9(does); \
  does(9); \
  does(10); \
  does(11); \
  does(12); \
  does(13); \
  does(14); \
  does(15); \
  does(16); \
  does(17); \
  does(18); \
  does(19); \
  does(20); \
  does(21); \
  does(22); \
  does(23); \
  does(24)

// The first cell of entry n of the list, or one beyond the grid where the list has ended.
ivec2 corner(int n, ivec2 grid)
{
  if (n >= last) {
    return grid;
  }
  int tile = int(texelFetch(tiles, ivec3(n & 255, n >> 8, 0), 0).r);
  return 4 * ivec2(tile & 4095, tile >> 12);
}

// Of the tile of invocations (·, y).
ivec2 corner(ivec2 grid)
{
  return corner(first + int(gl_GlobalInvocationID.y), grid);
}

// The place of invocation (x, ·) in rows of eight, or of four.
ivec2 in_eights()
{
  int x = int(gl_GlobalInvocationID.x);
  return ivec2(x & 7, x >> 3);
}

ivec2 in_fours()
{
  int x = int(gl_GlobalInvocationID.x);
  return ivec2(x & 3, x >> 2);
}

// Which of a cell's four weights is for the coarse cell p, where the cell is OFFSET(k) from 2p.
#define TAKES(k) (((k) % 3 == 0 ? 1 : 0) + ((k) / 3 == 0 ? 2 : 0))
