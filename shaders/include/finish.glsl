// Stores a pixel of the finished picture, premultiplied. LEVELS: display code values (view transform Standard), top row
// first; else scene-linear, bottom row first, as in Blender and OpenGL. height: rows of the picture.
#if LEVELS
layout(rgba8) uniform writeonly image2DArray picture;
#else
layout(rgba32f) uniform writeonly image2DArray picture;
uniform int height;
#endif

void finish(ivec2 pixel, vec4 color) {
#if LEVELS
  color.rgb = to_level(clamp(straight(color), 0.0, 1.0)) * color.a;
  imageStore(picture, ivec3(pixel, 0), color);
#else
  imageStore(picture, ivec3(pixel.x, height - 1 - pixel.y, 0), color);
#endif
}
