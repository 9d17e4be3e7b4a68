// Weighted sums of SPAN neighbours along a line, of four Gaussians at once. Whoever includes it has declared `kernels` (TonemapKernels).

const int SPAN = 8;

vec4 span_weight(uint group, int distance) {
    uint i = uint(distance + 48);
    return kernels.part[group * 3u + i / 32u].at[i % 32u];
}

// Adds to sum[k] the samples at `start` to `start` + 7 along the line, as pixel k sees them. Each weight is loaded once for all pairs of a
// sample and a pixel of the same distance.
#define SPAN_ADD(group, start, samples, sum)                          \
    {                                                                 \
        vec4 w[2 * SPAN - 1];                                         \
        [[unroll]] for (int j = 0; j < 2 * SPAN - 1; ++j) {           \
            w[j] = span_weight(group, start + j - (SPAN - 1));        \
        }                                                             \
        [[unroll]] for (int a = 0; a < SPAN; ++a) {                   \
            [[unroll]] for (int k = 0; k < SPAN; ++k) {               \
                sum[k] += w[a - k + SPAN - 1] * samples[a];           \
            }                                                         \
        }                                                             \
    }
