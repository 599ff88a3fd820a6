// What the passes over a graph share. Node n lies in column n & 4095 and row n >> 12 of its textures.
ivec3 at(int n, int layer)
{
  return ivec3(n & 4095, n >> 12, layer);
}

// The node of an invocation; those from `count` on are none.
int node()
{
  return int(gl_GlobalInvocationID.x) + 4096 * int(gl_GlobalInvocationID.y);
}

int layer()
{
  return int(gl_GlobalInvocationID.z);
}
