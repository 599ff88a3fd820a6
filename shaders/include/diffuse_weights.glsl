// How much every cell takes of the coarse cells around it: along a line of coarse cells by what it is coupled to on
// either side, between four of them by its own equation. Given couplings(i, c, diagonal): what ties the free cell i to
// the free ones around it, and its diagonal; nothing for a fixed cell. And is_free(i): whether it is one of the free.
// Where a dot lies on a coarse cell, that cell stands for those around the dot: they take a little of it, or coarser
// grids would know of nothing as near. Beyond the last coarse cell, up to the frame's edge, a cell has that one alone.

bool is_fixed(ivec2 i)
{
  return inside(i, size) && !is_free(i);
}

// Whether the coarse cell at i is fixed, and what lies on either side of it across a line is not: no wall.
bool is_dot(ivec2 i, ivec2 across)
{
  return is_fixed(i) && !is_fixed(i + across) && !is_fixed(i - across);
}

// What a cell takes of the coarse cells before and after it in its row, or in its column.
vec2 between(ivec2 i, bool in_row)
{
  float c[9];
  float diagonal;
  couplings(i, c, diagonal);
  float coupled = 0.0;
  for (int k = 0; k < 9; k++) {
    coupled += c[k];
  }
  // How closely the cell follows those around it.
  float follows = diagonal > 0.0 ? clamp(coupled / diagonal, 0.0, 1.0) : 0.0;
  ivec2 along = in_row ? ivec2(1, 0) : ivec2(0, 1);
  ivec2 before = i - along;
  ivec2 after = i + along;
  if (!inside(after, size)) {
    return vec2(follows, 0.0);
  }
  bvec2 dots = bvec2(is_dot(before, along.yx), is_dot(after, along.yx));
  if (any(dots)) {
    return follows * mix(vec2(is_free(before), is_free(after)) * 2.0 / 3.0, vec2(1.0 / 6.0), dots);
  }
  vec2 ends = in_row ? vec2(c[0] + c[3] + c[6], c[2] + c[5] + c[8]) : vec2(c[0] + c[1] + c[2], c[6] + c[7] + c[8]);
  // What holds the cell is taken to lie on the side that pulls less, and for the rest beside the line, where it holds
  // the coarse cells as well.
  float pull = ends.x + ends.y;
  float held = max(0.0, diagonal - pull - (in_row ? c[1] + c[7] : c[3] + c[5]));
  float aside = max(0.0, held - abs(ends.x - ends.y));
  float total = pull + held - (1.0 - hold) * aside;
  return total > 1e-3 * diagonal ? ends / total : vec2(0.0);
}

void store(ivec2 i, vec4 value)
{
  if (inside(i, size)) {
    imageStore(weights, ivec3(i, 0), value);
  }
}

// Invocations (·, y) run over the 2 × 2 cells of two tiles.
void main()
{
  ivec2 id = ivec2(gl_GlobalInvocationID);
  ivec2 p = corner(first + 2 * id.y + (id.x >> 2), size) + 2 * ivec2(id.x & 1, id.x >> 1 & 1);
  if (!inside(p, size)) {
    return;
  }
  float c[9];
  float diagonal;
  couplings(p, c, diagonal);
  vec2 above = between(p + ivec2(1, 0), true);
  vec2 below = between(p + ivec2(1, 2), true);
  vec2 before = between(p + ivec2(0, 1), false);
  vec2 after = between(p + ivec2(2, 1), false);
  store(p, vec4(diagonal > 0.0 ? 1.0 : 0.0, 0.0, 0.0, 0.0));
  store(p + ivec2(1, 0), vec4(above, 0.0, 0.0));
  store(p + ivec2(0, 1), vec4(before.x, 0.0, before.y, 0.0));
  couplings(p + 1, c, diagonal);
  vec4 middle = vec4(c[0] + c[1] * above.x + c[3] * before.x,
                     c[2] + c[1] * above.y + c[5] * after.x,
                     c[6] + c[7] * below.x + c[3] * before.y,
                     c[8] + c[7] * below.y + c[5] * after.y);
  store(p + 1, diagonal > 0.0 ? middle / diagonal : vec4(0.0));
}
