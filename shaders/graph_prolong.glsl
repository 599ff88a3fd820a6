// Adds to every node's value its parent's correction, of one cycle or of two.
#include "graph.glsl"

void main()
{
  int n = node();
  if (n >= count) {
    return;
  }
  ivec3 p = at(n, layer());
  int parent = int(imageLoad(nodes, at(n, 0)).z);
  if (parent < parents) {
    ivec3 q = at(parent, p.z);
    vec4 correction = imageLoad(once, q) + (twice > 0 ? imageLoad(again, q) : vec4(0.0));
    imageStore(values, p, imageLoad(values, p) + amount * correction);
  }
}
