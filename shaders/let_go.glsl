// Uses as many samplers and images as any pass, so that all of them are bound anew; see
// shutter_addon/blender/devices/blender_gpu.py.
void main()
{
  ivec3 first = ivec3(0, 0, layer);
  vec4 sum = texelFetch(sampled_0, first, 0) + texelFetch(sampled_1, first, 0) + texelFetch(sampled_2, first, 0) +
             texelFetch(sampled_3, first, 0);
  imageStore(stored_0, first, sum);
  imageStore(stored_1, first, sum);
  imageStore(stored_2, first, sum);
  imageStore(stored_3, first, sum);
}
