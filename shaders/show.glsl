// Draws in the preview. Textures have the top row first; a texel is a block of `block` × `block` pixels of `size`.
#ifdef QUAD
// Places a part of the picture in the region. corner: in pixels of the region; place: in the picture, y up.
in vec2 corner;
in vec2 place;
out vec2 at;
out vec2 pixel;
uniform mat4 ModelViewProjectionMatrix;

void main() {
  at = place;
  pixel = corner;
  gl_Position = ModelViewProjectionMatrix * vec4(corner, 0.0, 1.0);
}
#else
in vec2 at;
in vec2 pixel;
out vec4 shown;
uniform bool srgbTarget;  // set by Blender: the target encodes what is drawn
uniform float opacity;
#  include "light.glsl"

// Premultiplied code values for the region: Blender shows what is drawn over a preview with a gamma of 2.2.
vec4 on_region(vec4 color) {
  return srgbTarget ? vec4(pow(max(straight(color), 0.0), vec3(2.2)) * color.a, color.a) : color;
}
#endif

#ifdef PICTURE
// Draws a composed picture's levels.
uniform sampler2DArray picture;

void main() {
  shown = on_region(texture(picture, vec3(at.x, 1.0 - at.y, 0.0)) * opacity);
}

#elif defined(COEFFICIENTS) || defined(EDGES)
// coefficients: four shutters per layer.
uniform sampler2DArray coefficients, palette;
uniform ivec2 size;
uniform int block, count;
uniform float unit;  // pixels of the region per unit of the interface
#endif

#ifdef COEFFICIENTS
// Draws the shutters' colours and patterns, mixed by the pixel's coefficients.

bool is_line(float place, float period) {
  return place - floor(place / period) * period < 1.7;
}

// Whether a shutter's pattern has ink at a place; core/pixels/patterns.py is the reference.
bool is_marked(int index, vec2 place) {
  bool across = is_line(place.x, 8.0), up = is_line(place.y, 8.0);
  bool rising = is_line(place.x - place.y + 0.3, 12.0), falling = is_line(place.x + place.y + 0.3, 12.0);
  switch (index % 8) {
    case 1: return rising;
    case 2: return length(place - floor(place / 8.0) * 8.0 - 4.0) < 1.8;
    case 3: return falling;
    case 4: return up;
    case 5: return across;
    case 6: return rising || falling;
    case 7: return across || up;
  }
  return false;
}

vec3 painted(vec3 color, int index) {
  float ink = dot(color, vec3(0.2126, 0.7152, 0.0722)) < 0.35 ? 1.0 : 0.0;
  return mix(color, vec3(ink), is_marked(index, pixel / unit) ? 0.4 : 0.0);
}

void main() {
  ivec2 texel = ivec2(vec2(at.x, 1.0 - at.y) * vec2(size)) / block;
  vec3 mix_of_colors = vec3(0.0);
  float sum = 0.0;
  for (int i = 0; i < count; i++) {
    float share = max(texelFetch(coefficients, ivec3(texel, i / 4), 0)[i % 4], 0.0);
    mix_of_colors += share * painted(texelFetch(palette, ivec3(i, 0, 0), 0).rgb, i);
    sum += share;
  }
  shown = on_region(vec4(mix_of_colors / max(sum, 1e-6), 1.0) * opacity);
}

#elif defined(EDGES)
// Draws a line around the pixels of which a shutter gets more than half, in its colour. The first shutter gets none.
int most(vec2 place) {
  vec2 all = vec2(size) / float(block);
  vec2 texels = clamp(vec2(place.x, 1.0 - place.y) * all, vec2(0.5), all - 0.5);
  for (int i = 1; i < count; i++) {
    vec3 where = vec3(texels / vec2(textureSize(coefficients, 0).xy), float(i / 4));
    if (textureLod(coefficients, where, 0.0)[i % 4] > 0.5) {
      return i;
    }
  }
  return 0;
}

void main() {
  vec2 across = dFdx(at) * unit, up = dFdy(at) * unit;
  int here = most(at), highest = here, least = here;
  for (int i = 0; i < 4; i++) {
    int there = most(at + (i < 2 ? across : up) * (i % 2 == 0 ? 0.5 : -0.5));
    highest = max(highest, there);
    least = min(least, there);
  }
  vec3 color = texelFetch(palette, ivec3(highest, 0, 0), 0).rgb;
  shown = on_region(vec4(color, 1.0) * (highest > least ? opacity : 0.0));
}

#elif defined(SCRIBBLES)
// Draws scribbles in the colours of their shutters. labels: 0 where free, else 1 + shutter.
uniform usampler2DArray labels;
uniform sampler2DArray palette;
uniform ivec2 size;
uniform int block;

void main() {
  ivec2 texel = ivec2(vec2(at.x, 1.0 - at.y) * vec2(size)) / block;
  int label = int(texelFetch(labels, ivec3(texel, 0), 0).r);
  vec3 color = texelFetch(palette, ivec3(max(label - 1, 0), 0, 0), 0).rgb;
  shown = on_region(vec4(color, 1.0) * (label > 0 ? opacity : 0.0));
}
#endif
