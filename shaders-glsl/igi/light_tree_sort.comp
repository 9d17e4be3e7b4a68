// One pass of a stable radix sort, by four bits of the keys. One workgroup; each invocation has an equal range of keys.
#version 460
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 128) in;

layout(binding = 0, scalar) readonly buffer Keys { uvec2 keys[]; };
layout(binding = 1, scalar) writeonly buffer Sorted { uvec2 sorted[]; };

layout(push_constant, scalar) uniform Push {
    uint total;
    uint shift; // lowest of the four bits
};

shared uint places[16 * 128]; // for each digit, for each range: first the count, then the next output index
shared uint sums[128];

void main() {
    uint lane = gl_LocalInvocationID.x;
    uint each = (total + 127u) / 128u;
    uint begin = min(lane * each, total), end = min(begin + each, total);
    for (uint digit = 0u; digit < 16u; ++digit) places[digit * 128u + lane] = 0u;
    for (uint i = begin; i < end; ++i) ++places[(keys[i].x >> shift & 15u) * 128u + lane];
    barrier();
    uint sum = 0u;
    for (uint i = 0u; i < 16u; ++i) sum += places[lane * 16u + i];
    sums[lane] = sum;
    barrier();
    uint before = 0u;
    for (uint i = 0u; i < lane; ++i) before += sums[i];
    for (uint i = 0u; i < 16u; ++i) {
        uint count = places[lane * 16u + i];
        places[lane * 16u + i] = before;
        before += count;
    }
    barrier();
    for (uint i = begin; i < end; ++i) {
        uvec2 key = keys[i];
        sorted[places[(key.x >> shift & 15u) * 128u + lane]++] = key;
    }
}
