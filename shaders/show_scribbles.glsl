// The pixels that scribbles hold, in the colours of their shutters. labels: top row first, 0 where free.
#include "show.glsl"

void main()
{
  ivec2 pixel = ivec2(vec2(at.x, 1.0 - at.y) * vec2(size));
  int label = int(texelFetch(labels, ivec3(pixel / block, 0), 0).r);
  vec3 color = texelFetch(palette, ivec3(max(label - 1, 0), 0, 0), 0).rgb;
  shown = on_region(vec4(color, 1.0) * (label > 0 ? opacity : 0.0));
}
