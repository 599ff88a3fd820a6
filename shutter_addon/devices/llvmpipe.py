"""Mesa's software renderer, llvmpipe, and what is as it is because of this one alone. Beside it there are the pass
compose_search, for what takes more iterations, and TILED in shaders/include/sums.glsl, as it stores rows."""

# Loop iterations of an invocation: it ends loops after 65,535 in all, without an error.
MOST_ITERATIONS = 60_000
# Bytes of a texture array: from one over 2 GiB it reads wrong values, without an error.
MOST_BYTES = 1 << 30


def is_llvmpipe(renderer: str) -> bool:
    """Whether a renderer, as it calls itself, is llvmpipe. Its memory is the machine's, and it keeps textures there row
    by row, where a GPU keeps tiles."""
    return "llvmpipe" in renderer
