// What both compositions share: the coefficients of a block's pixels, the sums over their frames, the finished picture.
// An invocation composes four pixels above one another, so that what it looks up in the table serves all of them. They
// are a matrix: a column each, of coefficients or of light.
// frames: source frame i in layer i mod `capacity`; coefficients: four shutters per layer; table: row 0 the gains, then
// the knots or the bars, four shutters per texel. The window's frame k is source frame `origin` + k · `direction`.
// GROUPS of four shutters, EDGES, DECODE, PREMULTIPLIED, ENCODED: see compute/gpu.py. Software renderers run both sides
// of every branch: what is costly stands in loops or behind these definitions.
#include "light.glsl"

ivec2 corner;
ivec2 places[4];  // of the block's pixels; beyond the picture's edge the last one inside
mat4 c[GROUPS];
mat4 total = mat4(0.0);
vec4 share = vec4(0.0);  // of the exposure that fell on frames that are there
vec4 centre = vec4(0.0);  // of the exposure in time, frames left out included

vec4 coefficients_at(ivec2 pixel, int group)
{
  return max(texelFetch(coefficients, ivec3((pixel + ivec2(0, top)) / aggregate, group), 0), 0.0);
}

// False where the block lies outside the picture.
bool start_block()
{
  corner = ivec2(gl_GlobalInvocationID.xy) * ivec2(1, 4);
  for (int i = 0; i < 4; i++) {
    places[i] = min(corner + ivec2(0, i), size - 1);
  }
  vec4 sum = vec4(0.0);
  for (int g = 0; g < GROUPS; g++) {
    c[g] = mat4(coefficients_at(places[0], g),
                coefficients_at(places[1], g),
                coefficients_at(places[2], g),
                coefficients_at(places[3], g));
    sum += vec4(1.0) * c[g];
  }
  for (int g = 0; g < GROUPS; g++) {
    c[g] = mat4(c[g][0] / sum.x, c[g][1] / sum.y, c[g][2] / sum.z, c[g][3] / sum.w);
  }
  return corner.x < size.x && corner.y < size.y;
}

// Σ cᵢ tableᵢ, for the table's row and the first of its columns.
vec4 mixed(int column, int row)
{
  vec4 sum = vec4(0.0);
  for (int g = 0; g < GROUPS; g++) {
    sum += texelFetch(table, ivec3(column + g, row, 0), 0) * c[g];
  }
  return sum;
}

// The frame's light as it is summed, premultiplied.
vec4 frame_light(ivec2 pixel, int slot)
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

void expose(int frame, vec4 weight)
{
#if EDGES == 2  // shorten
  centre += weight * (float(frame) + 0.5);
  int index = origin + direction * frame;
  weight = index >= 0 && index < count ? weight : vec4(0.0);
#endif
  share += weight;
  int layer = layer_of(frame);
  total += mat4(weight.x * frame_light(places[0], layer),
                weight.y * frame_light(places[1], layer),
                weight.z * frame_light(places[2], layer),
                weight.w * frame_light(places[3], layer));
}

void store(ivec2 pixel, vec4 color, float exposed, float time, float gain)
{
  if (pixel.y >= size.y) {
    return;
  }
  color /= max(exposed, 1e-6);
#if EDGES == 2
  // Where nothing of the shutter is left, the nearest frame that there is.
  color = exposed > 1e-6 ? color : frame_light(pixel, layer_of(int(time)));
#endif
#if ENCODED
  color.rgb = to_linear_exact(straight(color)) * color.a;
#endif
  color.rgb *= gain;
  // Bottom row first: Blender's order, and GL's.
  imageStore(picture, ivec3(pixel.x, height - 1 - top - pixel.y, 0), color);
}

void finish()
{
  vec4 gain = mixed(0, 0);
  store(corner, total[0], share.x, centre.x, gain.x);
  store(corner + ivec2(0, 1), total[1], share.y, centre.y, gain.y);
  store(corner + ivec2(0, 2), total[2], share.z, centre.z, gain.z);
  store(corner + ivec2(0, 3), total[3], share.w, centre.w, gain.w);
}
