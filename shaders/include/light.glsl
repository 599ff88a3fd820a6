// The sRGB transfer; core/frames/light.py is the reference.

// For code values in [0, 1]: a polynomial within 0.03 of an 8-bit level. Powers cost more than fetching a frame.
vec3 to_linear(vec3 x) {
  vec3 curve =
      ((((((-0.05115455 * x + 0.21591497) * x - 0.42194232) * x + 0.71005759) * x + 0.51325115) * x + 0.03294947) * x) +
      0.00091973;
  return mix(curve, x / 12.92, lessThanEqual(x, vec3(0.04045)));
}

vec3 to_linear_exact(vec3 encoded) {
  vec3 curve = pow((max(encoded, 0.04045) + 0.055) / 1.055, vec3(2.4));
  return mix(curve, encoded / 12.92, lessThanEqual(encoded, vec3(0.04045)));
}

// For code values of any range, which straight colours have that were premultiplied. In [0, 1] it is the polynomial.
vec3 to_linear_of_any(vec3 encoded) {
  return mix(to_linear(encoded), to_linear_exact(encoded), greaterThan(encoded, vec3(1.0)));
}

vec3 to_encoded(vec3 linear) {
  vec3 curve = 1.055 * pow(max(linear, 0.0031308), vec3(1.0 / 2.4)) - 0.055;
  return mix(curve, linear * 12.92, lessThanEqual(linear, vec3(0.0031308)));
}

// Like to_encoded, for light in [0, 1]: a polynomial of its fourth root, within 0.0005 of an 8-bit level.
vec3 to_level(vec3 linear) {
  vec3 x = sqrt(sqrt(max(linear, 0.0031308)));
  vec3 curve =
      (((((0.06820799 * x - 0.31841607) * x + 0.65718848) * x - 0.85295766) * x + 1.36592116) * x + 0.13960411) * x -
      0.05954661;
  return mix(curve, linear * 12.92, lessThanEqual(linear, vec3(0.0031308)));
}

// The alpha that a premultiplied colour was multiplied by; 1 if it is transparent up to rounding, where light is kept.
float cover(vec4 color) {
  return color.a > 1e-6 ? color.a : 1.0;
}

vec3 straight(vec4 color) {
  return color.rgb / cover(color);
}

// Converts samples to the light that is summed. DECODE: 0 unchanged, 1 to linear, 2 to encoded.
vec3 decoded(vec3 color) {
#if DECODE == 1
  return to_linear(color);
#elif DECODE == 2
  return to_encoded(color);
#else
  return color;
#endif
}
