// Helper passes for Blender's own GPU (blender/devices/blender_gpu.py).

#ifdef UNPACK
// Unpacks floats into the rows of a layer, from `top` on.
// PACKING: 0 floats, 1 whole numbers, 2 opaque bytes (R + 256 G + 65536 B), 3 pairs of bytes (R + 256 G, B + 256 A),
// 4 16-bit samples.
uniform sampler2DArray sent;
#  if PACKING == 1
layout(r32ui) uniform writeonly uimage2DArray stored;
#  else
layout(FORMAT) uniform writeonly image2DArray stored;
#  endif
uniform ivec2 size;
uniform int top, layer;

void at(ivec3 p) {
  vec4 values = texelFetch(sent, p, 0);
#  if PACKING == 1
  imageStore(stored, ivec3(p.x, p.y + top, layer), uvec4(values));
#  else
#    if PACKING == 2
  uint bytes = uint(values.r);
  values = vec4(uvec4(bytes, bytes >> 8, bytes >> 16, 255u) & 255u) / 255.0;
#    elif PACKING == 3
  uvec2 pairs = uvec2(values.rg);
  values = vec4(uvec4(pairs.r, pairs.r >> 8, pairs.g, pairs.g >> 8) & 255u) / 255.0;
#    elif PACKING == 4
  values /= 65535.0;
#    endif
  imageStore(stored, ivec3(p.x, p.y + top, layer), values);
#  endif
}
#  include "pixels.glsl"

#elif defined(LET_GO)
// Binds as many samplers and images as any pass, so that OpenGL keeps no earlier texture bound.
layout(local_size_x = 1) in;
uniform sampler2DArray sampled_0, sampled_1, sampled_2, sampled_3;
layout(rgba32f) uniform writeonly image2DArray stored_0, stored_1, stored_2, stored_3;
uniform int layer;

void main() {
  ivec3 first = ivec3(0, 0, layer);
  vec4 sum = texelFetch(sampled_0, first, 0) + texelFetch(sampled_1, first, 0) + texelFetch(sampled_2, first, 0) +
             texelFetch(sampled_3, first, 0);
  imageStore(stored_0, first, sum);
  imageStore(stored_1, first, sum);
  imageStore(stored_2, first, sum);
  imageStore(stored_3, first, sum);
}
#endif
