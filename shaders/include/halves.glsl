// Two 32-bit words in a texel of four 16-bit halves (rgba16ui). Images of two components that a pass loads and stores are
// missing in Metal and optional in Vulkan.
uvec2 words_of(uvec4 halves) {
  return halves.xz | (halves.yw << 16);
}

uvec4 halves_of(uvec2 words) {
  return uvec4(words & 0xFFFFu, words >> 16).xzyw;
}
