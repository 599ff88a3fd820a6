// A step of conjugate gradients: the solution and the residual. sums: residual · guess, and direction · answer with the
// answer's sign changed, as graph_residual gives it.
#include "graph.glsl"

void main()
{
  int n = node();
  if (n >= count) {
    return;
  }
  ivec3 p = at(n, layer());
  vec4 power = imageLoad(sums, ivec3(0, 0, p.z));
  vec4 answer = imageLoad(sums, ivec3(2, 0, p.z));
  vec4 way = vec4(0.0);
  for (int i = 0; i < 4; i++) {
    way[i] = answer[i] < 0.0 ? -power[i] / answer[i] : 0.0;
  }
  vec4 start = fresh == 0 ? imageLoad(solution, p) : vec4(0.0);
  imageStore(solution, p, start + way * imageLoad(values, p));
  imageStore(result, p, imageLoad(result, p) + way * imageLoad(right, p));
}
