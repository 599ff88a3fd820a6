// The sRGB transfer; core/light.py is the reference.
vec3 to_linear(vec3 encoded)
{
  vec3 curve = pow((max(encoded, 0.04045) + 0.055) / 1.055, vec3(2.4));
  return mix(curve, encoded / 12.92, lessThanEqual(encoded, vec3(0.04045)));
}

vec3 to_encoded(vec3 linear)
{
  vec3 curve = 1.055 * pow(max(linear, 0.0031308), vec3(1.0 / 2.4)) - 0.055;
  return mix(curve, linear * 12.92, lessThanEqual(linear, vec3(0.0031308)));
}

// Straight colour of a premultiplied one; what is fully transparent keeps its light.
vec3 straight(vec4 color)
{
  return color.rgb / (color.a > 0.0 ? color.a : 1.0);
}
