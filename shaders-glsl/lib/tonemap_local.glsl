// The local component of the operator by its definition, one pixel at a time, for the ways of marking: any number of texel fetches,
// and nothing of where it is called from, so that all ways give the same bits.
#include "lib/tonemap.glsl"

layout(constant_id = 0) const uint LITERAL = 1;  // 0: it was computed before, for all pixels

layout(binding = 0) uniform sampler2D luminance;
#include "lib/tonemap_search.glsl"
layout(binding = 10, scalar) readonly buffer Search { TonemapSearch search; };
layout(binding = 11, scalar) readonly buffer Weights { float weights[]; };
layout(binding = 12, scalar) readonly buffer Statistics { TonemapStatistics statistics; };
layout(binding = 13) uniform sampler2D adaptation;  // where LITERAL is 0
#include "lib/tonemap_literal.glsl"

float tonemap_local(ivec2 pixel) {
    if (LITERAL == 0u) return texelFetch(adaptation, pixel, 0).r;
    return literal_adaptation(pixel, statistics.log_average);
}
