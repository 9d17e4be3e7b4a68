// Local adaptation of one pixel by its definition. Whoever includes it has declared `sampler2D luminance`, `search` (a TonemapSearch) and
// `weights[]` (float, four Gaussians interleaved), and includes tonemap/search.glsl before.

// One average: every sample of the neighbourhood.
float literal_average(ivec2 pixel, uint gaussian) {
    int radius = int(search.radius[gaussian]);
    uint base = gaussian / 4u * TONEMAP_STRIDE * 4u + gaussian % 4u;
    float sum = 0.0;
    for (int j = -radius; j <= radius; ++j) {
        float row = 0.0;
        for (int i = -radius; i <= radius; ++i) {
            row += weights[base + 4u * uint(abs(i))] * search_clamped(pixel + ivec2(i, j));
        }
        sum += weights[base + 4u * uint(abs(j))] * row;
    }
    return sum;
}

// The largest neighbourhood that is still even. `log_average` is that of the picture.
float literal_adaptation(ivec2 pixel, float log_average) {
    float found[4 * TONEMAP_GROUPS];
    for (uint i = 0u; i < 4u * TONEMAP_GROUPS; ++i) {
        found[i] = -1.0;
    }
    float level = 0.0;
    for (uint i = 0u; i < search.steps; ++i) {
        uint c = search.centre[i];
        uint s = search.surround[i];
        if (found[c] < 0.0) {
            found[c] = literal_average(pixel, c);
        }
        if (found[s] < 0.0) {
            found[s] = literal_average(pixel, s);
        }
        bool even = abs(found[c] - found[s]) < search.slope * found[c] + search.offset[i] * log_average;
        if (i == 0u || even) {
            level = found[c];
        }
        if (!even) {
            break;
        }
    }
    return level;
}
