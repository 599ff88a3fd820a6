// A moment between two frames (core/frames/frame_source.py); media/flow.py is the reference. Places are whole numbers, so
// that these are the same ones. A filmed pixel is a whole number, R + 256 G + 65536 B.
#define APART 4  // pixels between two vectors
#define UNIT 32  // of a coordinate, in a pixel
#define ZERO 32768

vec3 levels_at(int x, int y, int end) {
  uint bytes = imageLoad(filmed, ivec3(x, y, end)).r;
  return vec3(ivec3(bytes, bytes >> 8, bytes >> 16) & 255);
}

vec3 frame_light(ivec2 pixel, int end) {
  return to_linear(levels_at(pixel.x, pixel.y, end) / 255.0);
}

#if MOMENT == 2 || MOMENT == 3
ivec4 stored_at(int x, int y, int which) {
  return ivec4(imageLoad(vectors, ivec3(x, y, which)) * 65535.0 + 0.5);
}

// What the vectors say of a pixel, 16 times as large.
ivec4 spread_at(ivec2 pixel, int which) {
  ivec2 last = imageSize(vectors).xy - 1, place = pixel / APART, part = pixel - place * APART;
  ivec2 beside = min(place + 1, last);
  ivec4 above = stored_at(place.x, place.y, which) * (APART - part.x) + stored_at(beside.x, place.y, which) * part.x;
  ivec4 below = stored_at(place.x, beside.y, which) * (APART - part.x) + stored_at(beside.x, beside.y, which) * part.x;
  return above * (APART - part.y) + below * part.y;
}

// OpenCV's cubic interpolation.
vec4 cubic_weights(float x) {
  float y = 1.0 - x;
  float before = ((-0.75 * (x + 1.0) + 3.75) * (x + 1.0) - 6.0) * (x + 1.0) + 3.0;
  float here = (1.25 * x - 2.25) * x * x + 1.0, after = (1.25 * y - 2.25) * y * y + 1.0;
  return vec4(before, here, after, 1.0 - before - here - after);
}

vec3 row_at(ivec4 columns, int row, vec4 shares, int end) {
  return levels_at(columns.x, row, end) * shares.x + levels_at(columns.y, row, end) * shares.y +
         levels_at(columns.z, row, end) * shares.z + levels_at(columns.w, row, end) * shares.w;
}

// The levels of a filmed frame at a place in 1 / UNIT of a pixel. end: its layer
vec3 looked_up(ivec2 place, int end) {
  ivec2 last = imageSize(filmed).xy - 1, corner = place >> 5, part = place & (UNIT - 1);
  ivec4 columns = clamp(corner.x + ivec4(-1, 0, 1, 2), 0, last.x), rows = clamp(corner.y + ivec4(-1, 0, 1, 2), 0, last.y);
  vec4 across = cubic_weights(float(part.x) / float(UNIT)), down = cubic_weights(float(part.y) / float(UNIT));
  vec3 levels = row_at(columns, rows.x, across, end) * down.x + row_at(columns, rows.y, across, end) * down.y +
                row_at(columns, rows.z, across, end) * down.z + row_at(columns, rows.w, across, end) * down.w;
  return floor(clamp(levels, 0.0, 255.0) + 0.5);
}

// The linear light of a key moment at a pixel.
vec3 key_light(ivec2 pixel, int key) {
  ivec4 said = spread_at(pixel, key - 1);
  ivec2 path = said.xy - ZERO * APART * APART, here = pixel * UNIT;
  int left = moment.z - key, whole_path = APART * APART * moment.z;  // a power of two
  int shift = findMSB(whole_path), half_ = whole_path >> 1;
  vec3 first = looked_up(here - ((key * path + half_) >> shift), moment.w);
  vec3 second = looked_up(here + ((left * path + half_) >> shift), 1 - moment.w);
  vec2 shown = vec2(said.zw) / float(255 * APART * APART) + 0.05;
  float late = float(key) * shown.y;
  return to_linear(mix(first, second, late / (late + float(left) * shown.x)) / 255.0);
}
#endif
