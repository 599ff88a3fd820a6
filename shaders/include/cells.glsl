// Calls `at` for each cell of the listed tiles. PLACE: an invocation's cell in its tile.
void main() {
  ivec3 p = ivec3(corner(size) + PLACE, gl_GlobalInvocationID.z);
  if (inside(p.xy, size)) {
    at(p);
  }
}
