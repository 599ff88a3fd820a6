// What draws in previews. Textures have the top row first, `block` pixels of `size` along each side of a texel.
#ifdef QUAD
// A piece of the picture on the region. `corner`: in the region's pixels; `place`: in the picture, y up.
in vec2 corner;
in vec2 place;
out vec2 at;
uniform mat4 ModelViewProjectionMatrix;

void main() {
  at = place;
  gl_Position = ModelViewProjectionMatrix * vec4(corner, 0.0, 1.0);
}
#else
in vec2 at;
out vec4 shown;
uniform bool srgbTarget;  // set by Blender: what is drawn into encodes by itself
uniform float opacity;
#  include "light.glsl"

// Premultiplied code values as the region takes them: what is drawn over a preview, Blender shows with a gamma of 2.2.
vec4 on_region(vec4 color) {
  return srgbTarget ? vec4(pow(max(straight(color), 0.0), vec3(2.2)) * color.a, color.a) : color;
}
#endif

#ifdef PICTURE
// A composed picture's levels.
uniform sampler2DArray picture;

void main() {
  shown = on_region(texture(picture, vec3(at.x, 1.0 - at.y, 0.0)) * opacity);
}

#elif defined(COEFFICIENTS)
// The shutters' colours in shares of a pixel's coefficients, four shutters per layer.
uniform sampler2DArray coefficients, palette;
uniform ivec2 size;
uniform int block, count;

void main() {
  ivec2 pixel = ivec2(vec2(at.x, 1.0 - at.y) * vec2(size));
  vec3 mix_of_colors = vec3(0.0);
  float sum = 0.0;
  for (int i = 0; i < count; i++) {
    float share = max(texelFetch(coefficients, ivec3(pixel / block, i / 4), 0)[i % 4], 0.0);
    mix_of_colors += share * texelFetch(palette, ivec3(i, 0, 0), 0).rgb;
    sum += share;
  }
  shown = on_region(vec4(mix_of_colors / max(sum, 1e-6), 1.0) * opacity);
}

#elif defined(SCRIBBLES)
// The pixels that scribbles hold, in the colours of their shutters; labels: 0 where free.
uniform usampler2DArray labels;
uniform sampler2DArray palette;
uniform ivec2 size;
uniform int block;

void main() {
  ivec2 pixel = ivec2(vec2(at.x, 1.0 - at.y) * vec2(size));
  int label = int(texelFetch(labels, ivec3(pixel / block, 0), 0).r);
  vec3 color = texelFetch(palette, ivec3(max(label - 1, 0), 0, 0), 0).rgb;
  shown = on_region(vec4(color, 1.0) * (label > 0 ? opacity : 0.0));
}
#endif
