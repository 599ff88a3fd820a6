// Calls `at` for each cell of the listed tiles, at PLACE in them.
void main() {
  ivec3 p = ivec3(corner(size) + PLACE, gl_GlobalInvocationID.z);
  if (inside(p.xy, size)) {
    at(p);
  }
}
