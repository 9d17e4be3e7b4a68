// Local adaptation from small averages, computed here, and large ones, read bilinearly from the averages of halved pictures. An invocation
// has WIDE × 2 pixels, which share what they read. Loops that could be unrolled are not where that would make compilers slow.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "tonemap/tonemap.glsl"
#include "tonemap/kernels.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// Numbers of Gaussians at full size and on the first level; those of the second follow.
layout(constant_id = 0) const uint FULL = 2;
layout(constant_id = 1) const uint HALVED = 4;
// Largest radius at full size.
layout(constant_id = 2) const int RADIUS = 2;
layout(constant_id = 3) const uint STEPS = 10;
// 1: the surround of a step is the next Gaussian. 0: the Gaussian of twice the radius, where radii grow by one to STEPS and then by two.
layout(constant_id = 4) const uint NEXT = 0;
// 1: only blocks with an important pixel are worked on.
layout(constant_id = 5) const uint HAS_MAP = 0;

layout(binding = 0, scalar) readonly buffer Full { float luminance[]; };  // less L_min, as the averages
layout(binding = 1, scalar) uniform Kernels { TonemapKernels kernels; };  // of the Gaussians at full size
layout(binding = 2, scalar) readonly buffer Half { float averages1[]; };  // a plane for each Gaussian
layout(binding = 3, scalar) readonly buffer Quarter { float averages2[]; };
layout(binding = 4, scalar) uniform Choice { TonemapChoice choice; };
layout(binding = 5, scalar) readonly buffer Statistics { TonemapStatistics statistics; };
layout(binding = 6) uniform sampler2D importance;
layout(binding = 7, r32f) uniform writeonly image2D adaptation;

const int WIDE = 8;

uint surround_of(uint centre) {
    if (NEXT != 0u) {
        return centre + 1u;
    }
    uint radius = 2u * (centre + 1u);
    return radius <= STEPS ? radius - 1u : STEPS - 1u + radius / 2u - STEPS / 2u;
}

float full_weight(int distance, uint gaussian) {
    int i = distance + 48;
    return kernels.part[i / 32].at[i % 32][gaussian];
}

bool nothing_important(ivec2 first, ivec2 extent) {
    float most = 0.0;
    for (int y = 0; y < 2; ++y) {
        for (int x = 0; x < WIDE; ++x) {
            most = max(most, texelFetch(importance, min(first + ivec2(x, y), extent - 1), 0).r);
        }
    }
    return most == 0.0;
}

void main() {
    ivec2 extent = imageSize(adaptation);
    ivec2 first = ivec2(gl_GlobalInvocationID.xy) * ivec2(WIDE, 2);
    if (any(greaterThanEqual(first, extent))) {
        return;
    }
    if (HAS_MAP != 0u && nothing_important(first, extent)) {
        return;
    }

    // Full size: each row along itself, and from there to both rows of the block.
    float full[FULL][2][WIDE];
    [[unroll]] for (uint g = 0u; g < FULL; ++g) {
        [[unroll]] for (int k = 0; k < WIDE; ++k) {
            full[g][0][k] = 0.0;
            full[g][1][k] = 0.0;
        }
    }
    for (int y = -RADIUS; y <= RADIUS + 1; ++y) {
        int line = clamp(first.y + y, 0, extent.y - 1) * extent.x;
        float samples[WIDE + 2 * RADIUS];
        [[unroll]] for (int x = 0; x < WIDE + 2 * RADIUS; ++x) {
            samples[x] = luminance[line + clamp(first.x + x - RADIUS, 0, extent.x - 1)];
        }
        [[unroll]] for (uint g = 0u; g < FULL; ++g) {
            float upper = full_weight(y, g);
            float lower = full_weight(y - 1, g);
            [[unroll]] for (int k = 0; k < WIDE; ++k) {
                float sum = 0.0;
                [[unroll]] for (int d = -RADIUS; d <= RADIUS; ++d) {
                    sum += full_weight(d, g) * samples[k + d + RADIUS];
                }
                full[g][0][k] += upper * sum;
                full[g][1][k] += lower * sum;
            }
        }
    }

    float level[2][WIDE];
    bool even[2][WIDE];
    float centre[2][WIDE];
    float around[2][WIDE];
    [[unroll]] for (int y = 0; y < 2; ++y) {
        [[unroll]] for (int k = 0; k < WIDE; ++k) {
            level[y][k] = statistics.low + full[0][y][k];
            even[y][k] = true;
            centre[y][k] = full[0][y][k];
            around[y][k] = full[0][y][k];
        }
    }
    ivec2 last1 = (extent - 1) / 2;
    ivec2 last2 = (extent - 1) / 4;
    bool lower_half = first.y % 4 != 0;
    for (uint i = 0u; i < STEPS; ++i) {
        // The centre, then the surround.
        for (uint part = 0u; part < 2u; ++part) {
            uint gaussian = part == 0u ? i : surround_of(i);
            float read[2][WIDE];
            if (NEXT != 0u && part == 0u && i > 0u) {
                [[unroll]] for (int k = 0; k < WIDE; ++k) {
                    read[0][k] = around[0][k];
                    read[1][k] = around[1][k];
                }
            } else if (gaussian < FULL) {
                [[unroll]] for (int k = 0; k < WIDE; ++k) {
                    read[0][k] = full[0][0][k];
                    read[1][k] = full[0][1][k];
                }
                [[unroll]] for (uint g = 1u; g < FULL; ++g) {
                    if (gaussian == g) {
                        [[unroll]] for (int k = 0; k < WIDE; ++k) {
                            read[0][k] = full[g][0][k];
                            read[1][k] = full[g][1][k];
                        }
                    }
                }
            } else if (gaussian < FULL + HALVED) {
                // A pixel lies a quarter or three quarters of the way between two of the level's.
                int plane = int(gaussian - FULL) * (last1.x + 1) * (last1.y + 1);
                [[unroll]] for (int y = 0; y < 3; ++y) {
                    int line = plane + clamp(first.y / 2 - 1 + y, 0, last1.y) * (last1.x + 1);
                    float v[WIDE / 2 + 2];
                    [[unroll]] for (int x = 0; x < WIDE / 2 + 2; ++x) {
                        v[x] = averages1[line + clamp(first.x / 2 - 1 + x, 0, last1.x)];
                    }
                    [[unroll]] for (int k = 0; k < WIDE; ++k) {
                        int at = (k + 1) / 2;
                        float across = mix(v[at], v[at + 1], k % 2 == 0 ? 0.75 : 0.25);
                        read[0][k] = y == 0 ? 0.25 * across : y == 1 ? read[0][k] + 0.75 * across : read[0][k];
                        read[1][k] = y == 1 ? 0.75 * across : y == 2 ? read[1][k] + 0.25 * across : read[1][k];
                    }
                }
            } else {
                // An eighth, three, five or seven eighths.
                int plane = int(gaussian - FULL - HALVED) * (last2.x + 1) * (last2.y + 1);
                int above = first.y / 4 - (lower_half ? 0 : 1);
                int upper_line = plane + clamp(above, 0, last2.y) * (last2.x + 1);
                int lower_line = plane + clamp(above + 1, 0, last2.y) * (last2.x + 1);
                float way = lower_half ? 0.125 : 0.625;
                float a[WIDE / 4 + 2];
                float b[WIDE / 4 + 2];
                [[unroll]] for (int x = 0; x < WIDE / 4 + 2; ++x) {
                    int column = clamp(first.x / 4 - 1 + x, 0, last2.x);
                    float upper = averages2[upper_line + column];
                    float step = averages2[lower_line + column] - upper;
                    a[x] = upper + way * step;
                    b[x] = upper + (way + 0.25) * step;
                }
                [[unroll]] for (int k = 0; k < WIDE; ++k) {
                    int at = (k + 2) / 4;
                    float between = float((k + 2) % 4) * 0.25 + 0.125;
                    read[0][k] = mix(a[at], a[at + 1], between);
                    read[1][k] = mix(b[at], b[at + 1], between);
                }
            }
            [[unroll]] for (int y = 0; y < 2; ++y) {
                [[unroll]] for (int k = 0; k < WIDE; ++k) {
                    if (part == 0u) {
                        centre[y][k] = read[y][k];
                    } else {
                        around[y][k] = read[y][k];
                    }
                }
            }
        }
        float offset = choice.offset[i] * statistics.log_average;
        [[unroll]] for (int y = 0; y < 2; ++y) {
            [[unroll]] for (int k = 0; k < WIDE; ++k) {
                float c = statistics.low + centre[y][k];
                even[y][k] = even[y][k] && abs(centre[y][k] - around[y][k]) < choice.slope * c + offset;
                level[y][k] = even[y][k] ? c : level[y][k];
            }
        }
    }
    [[unroll]] for (int y = 0; y < 2; ++y) {
        [[unroll]] for (int k = 0; k < WIDE; ++k) {
            ivec2 pixel = first + ivec2(k, y);
            if (all(lessThan(pixel, extent))) {
                imageStore(adaptation, pixel, vec4(level[y][k]));
            }
        }
    }
}
