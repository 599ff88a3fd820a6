// By how much a solution differs from the noted one at most, among every so many cells: a part for each invocation. It is
// noted then.
void main()
{
  int n = int(gl_GlobalInvocationID.x);
  int layer = int(gl_GlobalInvocationID.z);
  if (n >= parts) {
    return;
  }
  vec4 largest = vec4(0.0);
  for (int k = n; k < size.x * size.y; k += parts) {
    ivec3 p = ivec3(k % size.x, k / size.x, layer);
    vec4 value = imageLoad(solution, p);
    largest = max(largest, abs(value - imageLoad(own, p)));
    imageStore(own, p, value);
  }
  imageStore(result, ivec3(n, 0, layer), largest);
}
