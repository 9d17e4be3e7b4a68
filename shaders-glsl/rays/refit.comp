// Boxes of the nodes of one level from those below, which are done. Twin of rays::encode.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/trace_nodes.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) buffer Nodes { uint nodes[]; };
layout(binding = 1, scalar) readonly buffer Records { vec4 records[]; };
layout(binding = 2, scalar) buffer Boxes { vec3 boxes[]; };
layout(push_constant, scalar) uniform Push {
    uint first; // node
    uint count;
    uint root;
    uint first_box; // the root's: corners 2 first_box and 2 first_box + 1
};

const float NOWHERE = 3.0e38;

bool finite(vec3 p) {
    return all(lessThan(abs(p), vec3(NOWHERE)));
}

// Biased exponent of the smallest power of two of which 254 cover `size`.
uint exponent(float size) {
    // One of the 255 is left for rounding.
    uint steps = floatBitsToUint(clamp(size / 254.0, 1e-30, 1e30));
    return (steps >> 23u) + ((steps & 0x7fffffu) != 0u ? 1u : 0u);
}

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    uint node = first + i;
    uint w = TRACE_NODE_WORDS * node;
    uint inner = nodes[w + 4u], leaves = nodes[w + 5u];
    vec3 low[8], high[8];
    vec3 all_low = vec3(NOWHERE), all_high = vec3(-NOWHERE);
    uint next_node = inner >> 8u, next_leaf = leaves >> 8u;
    for (uint slot = 0u; slot < 8u; ++slot) {
        low[slot] = vec3(NOWHERE);
        high[slot] = vec3(-NOWHERE);
        if ((leaves >> slot & 1u) != 0u) {
            for (uint corner = 0u; corner < 3u; ++corner) {
                vec3 p = records[3u * next_leaf + corner].xyz;
                if (finite(p)) {
                    low[slot] = min(low[slot], p);
                    high[slot] = max(high[slot], p);
                }
            }
            ++next_leaf;
        } else if ((inner >> slot & 1u) != 0u) {
            uint b = 2u * (first_box + next_node - root);
            low[slot] = boxes[b];
            high[slot] = boxes[b + 1u];
            ++next_node;
        }
        all_low = min(all_low, low[slot]);
        all_high = max(all_high, high[slot]);
    }
    boxes[2u * (first_box + node - root)] = all_low;
    boxes[2u * (first_box + node - root) + 1u] = all_high;
    // Nothing that has a place: any box will do, no triangle is hit.
    if (all_low.x > all_high.x) {
        all_low = vec3(0.0);
        all_high = vec3(0.0);
    }
    uint exponents = 0u;
    for (uint axis = 0u; axis < 3u; ++axis) {
        uint e = exponent(all_high[axis] - all_low[axis]);
        exponents |= e << (8u * axis);
        nodes[w + axis] = floatBitsToUint(all_low[axis]);
        float scale = uintBitsToFloat(e << 23u), inverse = uintBitsToFloat((254u - e) << 23u);
        uvec2 low_words = uvec2(0u), high_words = uvec2(0u);
        for (uint slot = 0u; slot < 8u; ++slot) {
            if (low[slot].x > high[slot].x) continue;
            precise float low_step = floor(clamp((low[slot][axis] - all_low[axis]) * inverse, 0.0, 255.0));
            precise float high_step = ceil(clamp((high[slot][axis] - all_low[axis]) * inverse, 0.0, 255.0));
            // The difference is rounded.
            precise float low_at = all_low[axis] + low_step * scale;
            precise float high_at = all_low[axis] + high_step * scale;
            if (low_at > low[slot][axis]) low_step -= 1.0;
            if (high_at < high[slot][axis]) high_step += 1.0;
            uint shift = 8u * (slot & 3u);
            uint low_byte = uint(clamp(low_step, 0.0, 255.0)) << shift, high_byte = uint(clamp(high_step, 0.0, 255.0)) << shift;
            if (slot < 4u) {
                low_words.x |= low_byte;
                high_words.x |= high_byte;
            } else {
                low_words.y |= low_byte;
                high_words.y |= high_byte;
            }
        }
        nodes[w + 6u + 2u * axis] = low_words.x;
        nodes[w + 7u + 2u * axis] = low_words.y;
        nodes[w + 12u + 2u * axis] = high_words.x;
        nodes[w + 13u + 2u * axis] = high_words.y;
    }
    nodes[w + 3u] = exponents;
}
