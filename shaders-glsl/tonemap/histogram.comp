// One digit of a radix selection: counts the digits at `shift` of those luminances of a rectangle whose higher bits are those found so
// far, for two ranks at once.
#version 460
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;
const int ROWS = 64;

layout(binding = 0) uniform sampler2D luminance;
layout(binding = 1, scalar) readonly buffer Found {
    uint prefix[2];  // bits above the digit, of the two ranks
    uint rank[2];
} found;
layout(binding = 2, scalar) buffer Bins { uint bins[]; };  // 2048: two of 1024, or one of 2048 for the first digit

layout(push_constant, scalar) uniform Push {
    ivec2 first;
    ivec2 last;
    uint shift;   // 20, 10, 0
};

shared uint counts[2048];

void main() {
    uint lane = gl_LocalInvocationIndex;
    for (uint i = lane; i < 2048u; i += 64u) {
        counts[i] = 0u;
    }
    barrier();
    ivec2 pixel = first + ivec2(gl_GlobalInvocationID.x, gl_GlobalInvocationID.y * ROWS);
    if (pixel.x <= last.x) {
        int end = min(pixel.y + ROWS, last.y + 1);
        for (; pixel.y < end; ++pixel.y) {
            uint bits = floatBitsToUint(texelFetch(luminance, pixel, 0).r);
            if (shift == 20u) {
                atomicAdd(counts[bits >> 20], 1u);
            } else {
                uint digit = (bits >> shift) & 1023u;
                uint above = bits >> (shift + 10u);
                if (above == found.prefix[0]) {
                    atomicAdd(counts[digit], 1u);
                }
                if (above == found.prefix[1]) {
                    atomicAdd(counts[1024u + digit], 1u);
                }
            }
        }
    }
    barrier();
    for (uint i = lane; i < 2048u; i += 64u) {
        if (counts[i] > 0u) {
            atomicAdd(bins[i], counts[i]);
        }
    }
}
