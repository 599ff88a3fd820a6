// What both compositions share: the pixel's coefficients, the sum over its frames, the finished picture.
// frames: source frame i in layer i mod `capacity`; coefficients: four shutters per layer; table: row 0 the gains, then
// the knots or the bars, four shutters per texel. The window's frame k is source frame `origin` + k · `direction`.
// GROUPS of four shutters, EDGES, DECODE, PREMULTIPLIED, ENCODED: see compute/gpu.py. Software renderers run both sides
// of every branch: what is costly stands in loops or behind these definitions.
#include "light.glsl"

vec4 c[GROUPS];
ivec2 pixel;
vec4 total = vec4(0.0);
float share = 0.0;  // of the exposure that fell on frames that are there
float centre = 0.0;  // of the exposure in time, frames left out included

void load_coefficients()
{
  float sum = 0.0;
  for (int g = 0; g < GROUPS; g++) {
    c[g] = max(texelFetch(coefficients, ivec3((pixel + ivec2(0, top)) / aggregate, g), 0), 0.0);
    sum += dot(c[g], vec4(1.0));
  }
  for (int g = 0; g < GROUPS; g++) {
    c[g] /= sum;
  }
}

// Σ cᵢ tableᵢ, for the table's row and the first of its columns.
float mixed(int column, int stride, int row)
{
  float sum = 0.0;
  for (int g = 0; g < GROUPS; g++) {
    sum += dot(c[g], texelFetch(table, ivec3(column + g * stride, row, 0), 0));
  }
  return sum;
}

// The frame's light as it is summed, premultiplied.
vec4 frame_light(int slot)
{
  vec4 color = texelFetch(frames, ivec3(pixel, slot), 0);
#if DECODE != 0
#  if PREMULTIPLIED
  color.rgb = straight(color);
#  endif
#  if DECODE == 1
  color.rgb = to_linear(color.rgb);
#  else
  color.rgb = to_encoded(color.rgb);
#  endif
  color.rgb *= color.a;
#elif !PREMULTIPLIED
  color.rgb *= color.a;
#endif
  return color;
}

// The layer of the window's frame, or of the clip's end beyond which it lies.
int layer_of(int frame)
{
  int index = origin + direction * frame;
#if EDGES == 1  // mirror
  int period = max(2 * (count - 1), 1);
  index = (index + 512 * period) % period;  // of a negative number, % is undefined
  index = min(index, period - index);
#endif
  // Source frame i lies in layer i mod capacity; a division costs more than the fetch.
  int layer = clamp(index, 0, count - 1) - lowest + lowest_layer;
  return layer < capacity ? layer : layer - capacity;
}

void expose(int frame, float weight)
{
#if EDGES == 2  // shorten
  centre += weight * (float(frame) + 0.5);
  int index = origin + direction * frame;
  weight = index >= 0 && index < count ? weight : 0.0;
#endif
  total += weight * frame_light(layer_of(frame));
  share += weight;
}

void finish()
{
  vec4 color = total / max(share, 1e-6);
#if EDGES == 2
  // Where nothing of the shutter is left, the nearest frame that there is.
  color = share > 1e-6 ? color : frame_light(layer_of(int(centre)));
#endif
#if ENCODED
  color.rgb = to_linear_exact(straight(color)) * color.a;
#endif
  color.rgb *= mixed(0, 1, 0);
  // Bottom row first: Blender's order, and GL's.
  imageStore(picture, ivec3(pixel.x, height - 1 - top - pixel.y, 0), color);
}
