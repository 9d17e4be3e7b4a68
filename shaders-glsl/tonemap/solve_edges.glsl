// The weights of the four edges of a pixel. Whoever includes it has declared `sampler2D across`, `sampler2D down` and the constant ONES,
// with which all weights are 1 and nothing is read.

// Right, left, below, above.
vec4 edges_of(ivec2 at, ivec2 last) {
    if (ONES != 0u) {
        return vec4(at.x < last.x, at.x > 0, at.y < last.y, at.y > 0);
    }
    return vec4(texelFetch(across, at, 0).r, at.x > 0 ? texelFetch(across, at - ivec2(1, 0), 0).r : 0.0,
                texelFetch(down, at, 0).r, at.y > 0 ? texelFetch(down, at - ivec2(0, 1), 0).r : 0.0);
}
