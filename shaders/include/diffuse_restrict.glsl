// What a grid's equations miss becomes the right side of the next one. The pass has near[25], the cells 2p − 2 … 2p + 2,
// and missing(i, at): what equation i misses, with its cell number `at` of them.
ivec3 p;
vec4 total;

void load_near(int n)
{
  near[n] = imageLoad(own, ivec3(clamp(2 * p.xy + OFFSET_OF_25(n), ivec2(0), size - 1), p.z));
}

void add_missing(int k)
{
  ivec3 i = ivec3(2 * p.xy + OFFSET(k), p.z);
  if (inside(i.xy, size)) {
    total += imageLoad(weights, ivec3(i.xy, 0))[TAKES(k)] * missing(i, AMONG_25(k));
  }
}

void main()
{
  p = ivec3(corner(coarse) + in_fours(), gl_GlobalInvocationID.z);
  if (!inside(p.xy, coarse)) {
    return;
  }
  EACH_OF_25(load_near);
  total = vec4(0.0);
  EACH_OF_9(add_missing);
  imageStore(next, p, total);
}
