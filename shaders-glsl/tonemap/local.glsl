// The local component of the operator for one pixel, for the ways of marking: any number of texel fetches, and nothing of where it is
// called from, so that all ways give the same bits.
#include "tonemap/tonemap.glsl"

// Computed before; Gaussian averages by definition; bilateral filter; windows that grow.
const uint LOCAL_LOOKUP = 0;  // export
const uint LOCAL_LITERAL = 1;  // export
const uint LOCAL_BILATERAL = 2;  // export
const uint LOCAL_GROWING = 3;  // export
layout(constant_id = 0) const uint LOCAL = LOCAL_LOOKUP;

layout(binding = 0) uniform sampler2D luminance;
#include "tonemap/search.glsl"
layout(binding = 10, scalar) readonly buffer Search { TonemapSearch search; };
layout(binding = 11, scalar) readonly buffer Weights { float weights[]; };
layout(binding = 12, scalar) readonly buffer Statistics { TonemapStatistics statistics; };
#include "tonemap/literal.glsl"
#include "tonemap/growing.glsl"

layout(binding = 13) uniform sampler2D adaptation;
layout(binding = 14) uniform sampler2D logarithm;
layout(binding = 15) uniform sampler2D blocks;
#include "tonemap/bilateral.glsl"
layout(binding = 16) uniform BilateralBlock { TonemapBilateral bilateral; };

float tonemap_local(ivec2 pixel) {
    if (LOCAL == LOCAL_LITERAL) return literal_adaptation(pixel, statistics.log_average);
    if (LOCAL == LOCAL_GROWING) return growing_adaptation(pixel);
    if (LOCAL == LOCAL_BILATERAL) {
        return bilateral.side == 1 ? bilateral_literal(pixel, bilateral) : bilateral_fast(pixel, bilateral);
    }
    return texelFetch(adaptation, pixel, 0).r;
}
