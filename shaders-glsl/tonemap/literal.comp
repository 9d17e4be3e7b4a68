// Local adaptation by its definition: every sample of every neighbourhood.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "tonemap/tonemap.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2D luminance;
#include "tonemap/search.glsl"
layout(binding = 1, scalar) readonly buffer Search { TonemapSearch search; };
layout(binding = 2, scalar) readonly buffer Weights { float weights[]; };
layout(binding = 3, scalar) readonly buffer Statistics { TonemapStatistics statistics; };
layout(binding = 4, r32f) uniform writeonly image2D adaptation;
#include "tonemap/literal.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(adaptation)))) {
        return;
    }
    imageStore(adaptation, pixel, vec4(literal_adaptation(pixel, statistics.log_average)));
}
