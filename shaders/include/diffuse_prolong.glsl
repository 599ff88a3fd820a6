// The correction of the coarser grid at cell p, bilinear.
vec4 prolonged(ivec3 p)
{
  ivec2 a = p.xy / 2;
  ivec2 b = min((p.xy + 1) / 2, coarse - 1);
  vec4 upper = texelFetch(correction, ivec3(a, p.z), 0) + texelFetch(correction, ivec3(b.x, a.y, p.z), 0);
  vec4 lower = texelFetch(correction, ivec3(a.x, b.y, p.z), 0) + texelFetch(correction, ivec3(b, p.z), 0);
  return (upper + lower) * (0.25 * scale(p.xy));
}
