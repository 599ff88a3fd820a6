// What both compositions share: the pixel's coefficients, the sum over its frames, the finished picture.
// frames: the window, a layer per frame; slots: for each frame of the window its layer, −1 where left out;
// coefficients: four shutters per layer; table: row 0 the gains, then the knots or the bars, four shutters per texel.
#include "light.glsl"

const int MAX_GROUPS = 8;  // of four shutters
const float NEGLIGIBLE = 1e-6;

vec4 c[MAX_GROUPS];
ivec2 pixel;
vec4 total = vec4(0.0);
float share = 0.0;  // of the exposure that fell on frames that are there
float centre = 0.0;  // of the exposure in time, frames left out included

void load_coefficients()
{
  float sum = 0.0;
  for (int g = 0; g < groups; g++) {
    c[g] = max(texelFetch(coefficients, ivec3((pixel + ivec2(0, top)) / aggregate, g), 0), 0.0);
    sum += dot(c[g], vec4(1.0));
  }
  for (int g = 0; g < groups; g++) {
    c[g] /= sum;
  }
}

// Σ cᵢ tableᵢ, for the table's row and the first of its columns.
float mixed(int column, int stride, int row)
{
  float sum = 0.0;
  for (int g = 0; g < groups; g++) {
    sum += dot(c[g], texelFetch(table, ivec3(column + g * stride, row, 0), 0));
  }
  return sum;
}

vec4 frame_light(int slot)
{
  vec4 color = texelFetch(frames, ivec3(pixel, slot), 0);
  if (decode != 0) {
    vec3 rgb = premultiplied != 0 ? straight(color) : color.rgb;
    rgb = decode == 1 ? to_linear(rgb) : to_encoded(rgb);
    return vec4(rgb * color.a, color.a);
  }
  return premultiplied != 0 ? color : vec4(color.rgb * color.a, color.a);
}

int slot_of(int frame)
{
  return int(texelFetch(slots, ivec3(frame, 0, 0), 0).r);
}

void expose(int frame, float weight)
{
  if (weight <= NEGLIGIBLE) {
    return;
  }
  centre += weight * (float(frame) + 0.5);
  int slot = slot_of(frame);
  if (slot >= 0) {
    total += weight * frame_light(slot);
    share += weight;
  }
}

// The present frame nearest to a time: frames left out lie at the window's ends.
int nearest_slot(float time)
{
  int frame = clamp(int(time), 0, window - 1);
  for (int distance = 0; distance < window; distance++) {
    int below = frame - distance;
    int above = frame + distance;
    if (below >= 0 && slot_of(below) >= 0) {
      return slot_of(below);
    }
    if (above < window && slot_of(above) >= 0) {
      return slot_of(above);
    }
  }
  return 0;
}

void finish()
{
  vec4 color = share > NEGLIGIBLE ? total / share : frame_light(nearest_slot(centre));
  if (encoded != 0) {
    color.rgb = to_linear(straight(color)) * color.a;
  }
  color.rgb *= mixed(0, 1, 0);
  // Bottom row first: Blender's order, and GL's.
  imageStore(picture, ivec3(pixel.x, height - 1 - top - pixel.y, 0), color);
}
