// What the passes of a multigrid share. Coarse cells lie on the even cells of the finer grid.
// Cells around one: k = 0 … 8, row by row, itself 4.
#define OFFSET(k) (ivec2((k) % 3, (k) / 3) - 1)

bool inside(ivec2 i, ivec2 grid)
{
  return all(greaterThanEqual(i, ivec2(0))) && all(lessThan(i, grid));
}

// How much the fine cell i takes of the coarse cell I, before its scale. A last odd cell has no other one to take from.
float share(ivec2 i, ivec2 I, ivec2 grid)
{
  vec2 weight = 0.5 * (vec2(equal(i / 2, I)) + vec2(equal(min((i + 1) / 2, grid - 1), I)));
  return weight.x * weight.y;
}
