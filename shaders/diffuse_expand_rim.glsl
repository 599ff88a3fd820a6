// What diffuse_expand makes, at the frame's last columns and rows: beyond the coarser grid's last cells a parabola that
// is level at the frame's edge. Invocations run over 2 × 2 cells.
#include "diffuse.glsl"

// The four cells' values.
mat4 values(ivec2 a, ivec2 b, vec2 bend, int layer)
{
  vec4 value = imageLoad(coarser, ivec3(a, layer));
  vec4 beside = mix(value, imageLoad(coarser, ivec3(b.x, a.y, layer)), bend.x);
  vec4 below = imageLoad(coarser, ivec3(a.x, b.y, layer));
  vec4 across = mix(below, imageLoad(coarser, ivec3(b, layer)), bend.x);
  return mat4(value, beside, mix(value, below, bend.y), mix(beside, across, bend.y));
}

void main()
{
  ivec2 p = corner(size) + 2 * in_fours();
  if (!inside(p, size)) {
    return;
  }
  ivec2 a = p / 2;
  vec2 ends = vec2(equal(a, coarse - 1));
  ivec2 b = max(a + 1 - 2 * ivec2(ends), 0);
  vec2 bend = mix(vec2(0.5), beyond, ends);
  vec4 least = vec4(0.0);
  for (int layer = 0; layer < layers; layer++) {
    mat4 m = values(a, b, bend, layer);
    least = min(least, min(min(m[0], m[1]), min(m[2], m[3])));
  }
  // No shutter gets less than nothing, and all of them together one.
  bend = any(lessThan(least, vec4(0.0))) ? mix(bend, vec2(0.0), ends) : bend;
  for (int layer = 0; layer < layers; layer++) {
    mat4 m = values(a, b, bend, layer);
    for (int k = 0; k < 4; k++) {
      ivec2 q = p + ivec2(k % 2, k / 2);
      if (inside(q, size)) {
        imageStore(solution, ivec3(q, layer), m[k]);
      }
    }
  }
}
