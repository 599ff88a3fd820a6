// Fills rows of a layer, from `top` on, from the floats that were sent; see shutter_addon/blender/devices/blender_gpu.py.
// PACKING: 0 as they are, 1 as whole numbers, 2 opaque bytes (R + 256 G + 65536 B), 3 pairs of bytes (R + 256 G,
// B + 256 A), 4 16-bit samples.
void main()
{
  ivec2 p = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(p, size))) {
    return;
  }
  vec4 values = texelFetch(sent, ivec3(p, 0), 0);
#if PACKING == 1
  imageStore(stored, ivec3(p.x, p.y + top, layer), uvec4(values));
#else
#  if PACKING == 2
  uint bytes = uint(values.r);
  values = vec4(uvec4(bytes, bytes >> 8, bytes >> 16, 255u) & 255u) / 255.0;
#  elif PACKING == 3
  uvec2 pairs = uvec2(values.rg);
  values = vec4(uvec4(pairs.r, pairs.r >> 8, pairs.g, pairs.g >> 8) & 255u) / 255.0;
#  elif PACKING == 4
  values /= 65535.0;
#  endif
  imageStore(stored, ivec3(p.x, p.y + top, layer), values);
#endif
}
