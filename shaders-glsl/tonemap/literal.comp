// Local adaptation by its definition: every sample of every neighbourhood. Or by windows that grow.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "tonemap/tonemap.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(constant_id = 0) const uint GROWING = 0;  // 1: windows that grow

layout(binding = 0) uniform sampler2D luminance;
#include "tonemap/search.glsl"
layout(binding = 1, scalar) readonly buffer Search { TonemapSearch search; };
layout(binding = 2, scalar) readonly buffer Weights { float weights[]; };
layout(binding = 3, scalar) readonly buffer Statistics { TonemapStatistics statistics; };
layout(binding = 4, r32f) uniform writeonly image2D adaptation;
#include "tonemap/literal.glsl"
#include "tonemap/growing.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(adaptation)))) {
        return;
    }
    float level = GROWING != 0 ? growing_adaptation(pixel) : literal_adaptation(pixel, statistics.log_average);
    imageStore(adaptation, pixel, vec4(level));
}
