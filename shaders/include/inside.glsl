// Whether a cell lies in a grid of that size.
bool inside(ivec2 i, ivec2 grid)
{
  return all(greaterThanEqual(i, ivec2(0))) && all(lessThan(i, grid));
}
