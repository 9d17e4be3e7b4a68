// Luminance as a buffer, which is read faster than an image on CPUs, and the first two levels of the pyramid of `local = "pyramid"`: means
// of 2 × 2 pixels, and of 2 × 2 of those. Sizes are halved and rounded up; what a level lacks at its end is its last row or column once more.
// All is less L_min, which the search adds again: so averages are as exact as the range of a picture needs, however narrow it is.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "tonemap/tonemap.glsl"

layout(local_size_x = 64) in;

layout(binding = 0) uniform sampler2D luminance;
layout(binding = 3, scalar) writeonly buffer Full { float level0[]; };
layout(binding = 1, scalar) writeonly buffer Half { float level1[]; };
layout(binding = 2, scalar) writeonly buffer Quarter { float level2[]; };
layout(binding = 4, scalar) readonly buffer Statistics { TonemapStatistics statistics; };

// An invocation has a pixel of the second level.
void main() {
    ivec2 last = textureSize(luminance, 0) - 1;
    ivec2 last1 = last / 2;
    ivec2 last2 = last1 / 2;
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThan(at, last2))) {
        return;
    }
    int width = last.x + 1;
    float four[2][2];
    [[unroll]] for (int y = 0; y < 2; ++y) {
        [[unroll]] for (int x = 0; x < 2; ++x) {
            ivec2 from = min(2 * at + ivec2(x, y), last1);
            ivec2 a = 2 * from;
            ivec2 b = min(a + 1, last);
            vec4 v = vec4(texelFetch(luminance, a, 0).r, texelFetch(luminance, ivec2(b.x, a.y), 0).r,
                          texelFetch(luminance, ivec2(a.x, b.y), 0).r, texelFetch(luminance, b, 0).r);
            v -= statistics.low;
            level0[a.y * width + a.x] = v.x;
            level0[a.y * width + b.x] = v.y;
            level0[b.y * width + a.x] = v.z;
            level0[b.y * width + b.x] = v.w;
            precise float upper = v.x + v.y;
            precise float lower = v.z + v.w;
            precise float mean = 0.25 * (upper + lower);
            four[y][x] = mean;
            // Twice the same where the level ends.
            level1[from.y * (last1.x + 1) + from.x] = mean;
        }
    }
    precise float mean = 0.25 * ((four[0][0] + four[0][1]) + (four[1][0] + four[1][1]));
    level2[at.y * (last2.x + 1) + at.x] = mean;
}
