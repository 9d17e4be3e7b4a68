// Pairs of occluders that may overlap, seen from the surfaces of a tile of 8×8 pixels: a row of bits for each occluder.
// A workgroup has one tile.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "fiv/fiv.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) readonly buffer Occluders { FivOccluder occluders[]; };
layout(binding = 1, scalar) readonly buffer Near { uint near[]; };
layout(binding = 2, scalar) readonly buffer Boxes { vec4 boxes[]; };
layout(binding = 3, scalar) writeonly buffer Pairs { uint pairs[]; };

layout(push_constant, scalar) uniform Push {
    uint occluder_count;
    uint first; // first occluder that gets a row
    uint count; // number of rows
    uint words; // words of a row
};

// Direction of the occluder's centre seen from the middle of the tile, and the greatest distance (chord) of a point of
// its disc from this direction, seen from anywhere in the tile.
vec4 cone(uint i, vec4 box) {
    vec3 offset = occluders[i].centre - box.xyz;
    float far = length(offset), radius = occluders[i].radius, nearest = far - box.w;
    if (nearest <= radius) return vec4(0.0, 0.0, 0.0, 4.0);
    // Seen from a point at this share of the distance, the direction differs by at most this chord.
    float part = box.w / far;
    float off = part * sqrt(2.0 / (1.0 + sqrt(max(1.0 - part * part, 0.0))));
    return vec4(offset / far, radius / nearest + off + 1e-4);
}

shared vec4 others[64];

void main() {
    uint lane = gl_LocalInvocationIndex;
    uint tile = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    vec4 box = boxes[tile];
    for (uint chunk = 0u; 64u * chunk < occluder_count; ++chunk) {
        uint other = 64u * chunk + lane;
        others[lane] = other < occluder_count ? cone(other, box) : vec4(9.0, 0.0, 0.0, 0.0);
        barrier();
        for (uint k = lane; k < count; k += 64u) {
            uint i = first + k;
            vec4 own = cone(i, box);
            bool counts = (near[tile * words + (i >> 5u)] >> (i & 31u) & 1u) != 0u;
            for (uint half_chunk = 0u; half_chunk < 2u; ++half_chunk) {
                uint word = 2u * chunk + half_chunk;
                if (word >= words) break;
                uint row = 0u, may = counts ? near[tile * words + word] : 0u;
                // Words without a bit need no test.
                uint end = may == 0u ? 0u : uint(findMSB(may)) + 1u;
                for (uint b = 0u; b < end; ++b) {
                    vec4 seen = others[32u * half_chunk + b];
                    vec3 apart = seen.xyz - own.xyz;
                    float reach = seen.w + own.w;
                    row |= uint(dot(apart, apart) < reach * reach) << b;
                }
                row &= may;
                if (i >> 5u == word) row &= ~(1u << (i & 31u));
                pairs[(tile * count + k) * words + word] = row;
            }
        }
        barrier();
    }
}
