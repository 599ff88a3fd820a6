// The sum of the parts, in one invocation. place: which of `sums` it becomes; the one before it moves to place + 1.
void main()
{
  int layer = int(gl_GlobalInvocationID.z);
  vec4 total = vec4(0.0);
  for (int k = 0; k < parts; k++) {
    total += imageLoad(result, ivec3(k, 0, layer));
  }
  imageStore(sums, ivec3(place + 1, 0, layer), imageLoad(sums, ivec3(place, 0, layer)));
  imageStore(sums, ivec3(place, 0, layer), total);
}
