// What a grid's equations miss becomes the right side of the next one, given missing(i, near, at): what equation i
// misses, with its cell number `at` of the 25 near 2p.
void main()
{
  ivec3 p = ivec3(corner(coarse) + in_fours(), gl_GlobalInvocationID.z);
  if (!inside(p.xy, coarse)) {
    return;
  }
  vec4 near[25];
  for (int n = 0; n < 25; n++) {
    near[n] = imageLoad(own, ivec3(clamp(2 * p.xy + ivec2(n % 5, n / 5) - 2, ivec2(0), size - 1), p.z));
  }
  vec4 total = vec4(0.0);
  for (int k = 0; k < 9; k++) {
    ivec3 i = ivec3(2 * p.xy + OFFSET(k), p.z);
    if (inside(i.xy, size)) {
      total += imageLoad(weights, ivec3(i.xy, 0))[TAKES(k)] * missing(i, near, 5 * (k / 3 + 1) + k % 3 + 1);
    }
  }
  imageStore(next, p, total);
}
