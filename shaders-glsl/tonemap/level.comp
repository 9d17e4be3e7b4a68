// One Gaussian's average of every pixel of a level of the pyramid. An invocation has WIDE × HIGH pixels: each row that they see is averaged
// along itself, and added to all of them.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "tonemap/kernels.glsl"

layout(local_size_x = 8, local_size_y = 4) in;

// Largest radius of all Gaussians.
layout(constant_id = 0) const int RADIUS = 3;

layout(binding = 0, scalar) readonly buffer Level { float level[]; };
layout(binding = 1, scalar) uniform Kernels { TonemapKernels kernels; };
layout(binding = 2, scalar) writeonly buffer Averages { float averages[]; };  // a plane for each Gaussian

layout(push_constant, scalar) uniform Push {
    ivec2 size;  // of the level
    int radius[24];
};

const int WIDE = 8;
const int HIGH = 4;

float weight(uint gaussian, int distance) {
    uint i = uint(distance + 48);
    return kernels.part[gaussian / 4u * 3u + i / 32u].at[i % 32u][gaussian % 4u];
}

void main() {
    ivec2 first = ivec2(gl_GlobalInvocationID.xy) * ivec2(WIDE, HIGH);
    if (any(greaterThanEqual(first, size))) {
        return;
    }
    uint gaussian = gl_WorkGroupID.z;
    float along[RADIUS + 1];
    [[unroll]] for (int d = 0; d <= RADIUS; ++d) {
        along[d] = weight(gaussian, d);
    }
    float sum[HIGH][WIDE];
    [[unroll]] for (int j = 0; j < HIGH; ++j) {
        [[unroll]] for (int k = 0; k < WIDE; ++k) {
            sum[j][k] = 0.0;
        }
    }
    for (int y = -radius[gaussian]; y < radius[gaussian] + HIGH; ++y) {
        int line = clamp(first.y + y, 0, size.y - 1) * size.x;
        float samples[WIDE + 2 * RADIUS];
        [[unroll]] for (int x = 0; x < WIDE + 2 * RADIUS; ++x) {
            samples[x] = level[line + clamp(first.x + x - RADIUS, 0, size.x - 1)];
        }
        float down[HIGH];
        [[unroll]] for (int j = 0; j < HIGH; ++j) {
            down[j] = weight(gaussian, y - j);
        }
        [[unroll]] for (int k = 0; k < WIDE; ++k) {
            float row = along[0] * samples[k + RADIUS];
            [[unroll]] for (int d = 1; d <= RADIUS; ++d) {
                row += along[d] * (samples[k + RADIUS - d] + samples[k + RADIUS + d]);
            }
            [[unroll]] for (int j = 0; j < HIGH; ++j) {
                sum[j][k] += down[j] * row;
            }
        }
    }
    int to = (int(gaussian) * size.y + first.y) * size.x + first.x;
    [[unroll]] for (int j = 0; j < HIGH; ++j) {
        [[unroll]] for (int k = 0; k < WIDE; ++k) {
            if (first.x + k < size.x && first.y + j < size.y) {
                averages[to + j * size.x + k] = sum[j][k];
            }
        }
    }
}
