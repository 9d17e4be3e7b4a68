// Gaussian averages of growing extent and the choice among them. Whoever includes it has declared `sampler2D luminance`.
// A pixel's averages come by definition (search_average); search_choose() then wants them in `search_found`.

const uint TONEMAP_STRIDE = 48;  // export
const uint TONEMAP_GROUPS = 6;  // export

struct TonemapSearch {
    uint steps;
    float slope;
    uint radius[24];    // of each Gaussian
    uint centre[16];    // of each step: a Gaussian
    uint surround[16];
    float offset[16];
};

float search_clamped(ivec2 at) {
    return texelFetch(luminance, clamp(at, ivec2(0), textureSize(luminance, 0) - 1), 0).r;
}

#include "tonemap/kernels.glsl"
