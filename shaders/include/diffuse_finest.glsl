// The finest grid: the 5-point Laplacian of the free pixels. Beyond the frame's edge there is nothing: weight 0.
const ivec2 CROSS[4] = ivec2[](ivec2(-1, 0), ivec2(1, 0), ivec2(0, -1), ivec2(0, 1));

// How far a pixel follows the coarser grid: 0 where it is fixed, and only there.
float scale(ivec2 i)
{
  return texelFetch(following, ivec3(i, 0), 0).r;
}
