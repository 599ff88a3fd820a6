// Products of two sets of values, summed over every so many cells: a part for each invocation, in a fixed order.
void main()
{
  int n = int(gl_GlobalInvocationID.x);
  int layer = int(gl_GlobalInvocationID.z);
  if (n >= parts) {
    return;
  }
  vec4 total = vec4(0.0);
  for (int k = n; k < size.x * size.y; k += parts) {
    ivec3 p = ivec3(k % size.x, k / size.x, layer);
    total += imageLoad(values, p) * imageLoad(right, p);
  }
  imageStore(result, ivec3(n, 0, layer), total);
}
