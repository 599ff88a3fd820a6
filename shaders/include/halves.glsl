// Two words of 32 bits in a texel of four halves, rgba16ui: Metal has no images of two components that a pass both loads
// from and stores to, and Vulkan has them as an extra feature alone.
uvec2 words_of(uvec4 halves) {
  return halves.xz | (halves.yw << 16);
}

uvec4 halves_of(uvec2 words) {
  return uvec4(words & 0xFFFFu, words >> 16).xzyw;
}
