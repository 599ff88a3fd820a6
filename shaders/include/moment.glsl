// A moment between two frames (core/frames/moments.py); media/flow.py is the reference. Places are whole numbers, so that
// these are the same ones.
#define APART 4  // pixels between two vectors
#define UNIT 32  // of a coordinate, in a pixel
#define ZERO 32768

// What the vectors say of a pixel, 16 times as large.
ivec4 spread_at(ivec2 pixel) {
  ivec2 last = textureSize(vectors, 0).xy - 1, place = pixel / APART, part = pixel - place * APART;
  ivec2 next = min(place + 1, last);
  ivec4 above = ivec4(texelFetch(vectors, ivec3(place, 0), 0)) * (APART - part.x) +
                ivec4(texelFetch(vectors, ivec3(next.x, place.y, 0), 0)) * part.x;
  ivec4 below = ivec4(texelFetch(vectors, ivec3(place.x, next.y, 0), 0)) * (APART - part.x) +
                ivec4(texelFetch(vectors, ivec3(next, 0), 0)) * part.x;
  return above * (APART - part.y) + below * part.y;
}

// OpenCV's cubic interpolation.
vec4 cubic_weights(float x) {
  float y = 1.0 - x;
  float before = ((-0.75 * (x + 1.0) + 3.75) * (x + 1.0) - 6.0) * (x + 1.0) + 3.0;
  float here = (1.25 * x - 2.25) * x * x + 1.0, after = (1.25 * y - 2.25) * y * y + 1.0;
  return vec4(before, here, after, 1.0 - before - here - after);
}

vec3 row_at(sampler2DArray frame, ivec4 columns, int row, vec4 weights) {
  return texelFetch(frame, ivec3(columns.x, row, 0), 0).rgb * weights.x +
         texelFetch(frame, ivec3(columns.y, row, 0), 0).rgb * weights.y +
         texelFetch(frame, ivec3(columns.z, row, 0), 0).rgb * weights.z +
         texelFetch(frame, ivec3(columns.w, row, 0), 0).rgb * weights.w;
}

// A frame at a place in 1 / UNIT of a pixel, in levels of 8 bits.
vec3 looked_up(sampler2DArray frame, ivec2 place) {
  ivec2 last = textureSize(frame, 0).xy - 1, whole = place >> 5, part = place & (UNIT - 1);
  if (part == ivec2(0)) {
    return texelFetch(frame, ivec3(clamp(whole, ivec2(0), last), 0), 0).rgb;
  }
  ivec4 columns = clamp(whole.x + ivec4(-1, 0, 1, 2), 0, last.x), rows = clamp(whole.y + ivec4(-1, 0, 1, 2), 0, last.y);
  vec4 across = cubic_weights(float(part.x) / float(UNIT)), down = cubic_weights(float(part.y) / float(UNIT));
  vec3 color = row_at(frame, columns, rows.x, across) * down.x + row_at(frame, columns, rows.y, across) * down.y +
               row_at(frame, columns, rows.z, across) * down.z + row_at(frame, columns, rows.w, across) * down.w;
  return floor(clamp(color, 0.0, 1.0) * 255.0 + 0.5) / 255.0;
}

// The moment's color at a pixel, in levels of 8 bits. moment: its number, of how many; the shift of a path's parts
vec3 moment_at(ivec2 pixel) {
  ivec4 said = spread_at(pixel);
  ivec2 path = said.xy - ZERO * APART * APART, here = pixel * UNIT;
  int left = moment.y - moment.x, half_ = 1 << (moment.z - 1);
  vec3 first = to_linear(looked_up(first_frame, here - ((moment.x * path + half_) >> moment.z)));
  vec3 second = to_linear(looked_up(second_frame, here + ((left * path + half_) >> moment.z)));
  vec2 shown = vec2(said.zw) / float(255 * APART * APART) + 0.05;
  float late = float(moment.x) * shown.y;
  vec3 mixed = mix(first, second, late / (late + float(left) * shown.x));
  return floor(to_encoded(mixed) * 255.0 + 0.5) / 255.0;
}
