// Local adaptation of one pixel by windows that grow around it ring by ring. Each sample is read once, and the search ends at the first window that is
// not even. Whoever includes it has declared `sampler2D luminance` and `search` (a TonemapSearch), and includes tonemap/search.glsl before.

const uint GROWING_RINGS = 32u;

// Sum over the ring of pixels at the distance `r` in the maximum norm.
float growing_ring(ivec2 pixel, int r) {
    float sum = 0.0;
    for (int i = -r; i <= r; ++i) {
        sum += search_clamped(pixel + ivec2(i, -r)) + search_clamped(pixel + ivec2(i, r));
    }
    for (int j = 1 - r; j < r; ++j) {
        sum += search_clamped(pixel + ivec2(-r, j)) + search_clamped(pixel + ivec2(r, j));
    }
    return sum;
}

// Mean over the window of 2r + 1 pixels to the side, from its sum.
float growing_mean(float sum, uint r) {
    float side = float(2u * r + 1u);
    return sum / (side * side);
}

// The largest window that is still even: its mean differs by little from that of twice its radius.
float growing_adaptation(ivec2 pixel) {
    float sums[GROWING_RINGS + 1u];
    sums[0] = search_clamped(pixel);
    uint rings = 0u;
    float level = 0.0;
    for (uint s = 1u; s <= search.steps; ++s) {
        while (rings < 2u * s) {
            sums[rings + 1u] = sums[rings] + growing_ring(pixel, int(rings) + 1);
            ++rings;
        }
        float centre = growing_mean(sums[s], s);
        bool even = abs(centre - growing_mean(sums[2u * s], 2u * s)) < search.slope * centre;
        if (s == 1u || even) {
            level = centre;
        }
        if (!even) {
            break;
        }
    }
    return level;
}
