// Calls `at` for each pixel of `size`, in each layer.
void main() {
  ivec3 p = ivec3(gl_GlobalInvocationID);
  if (all(lessThan(p.xy, size))) {
    at(p);
  }
}
