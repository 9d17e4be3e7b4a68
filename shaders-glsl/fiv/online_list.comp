// Lists the marked samples in the order of their numbers, as points that look at their occluder.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "fiv/fiv.glsl"
#include "fiv/online.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) readonly buffer Marks { uint marks[]; };
layout(binding = 1, scalar) readonly buffer Starts { uint starts[]; };
layout(binding = 2, scalar) readonly buffer Sets { FivSet sets[]; };
layout(binding = 3, scalar) readonly buffer Directions { vec3 directions[]; }; // from the receiver to the occluder
layout(binding = 4, scalar) readonly buffer Radii { float radii[]; };          // metres
layout(binding = 5, scalar) writeonly buffer Points { FivPoint points[]; };
layout(binding = 6, scalar) writeonly buffer Samples { uint samples[]; }; // sample number of each point

layout(push_constant, scalar) uniform Push {
    uint blocks;
    uint set_blocks; // blocks of a set
    uint rings;      // directions of a sphere
};

shared uint sums[64];

void main() {
    uint lane = gl_LocalInvocationID.x;
    uint block = gl_WorkGroupID.y * FIV_ROW + gl_WorkGroupID.x;
    if (block >= blocks) return;
    uint bits = marks[FIV_BLOCK_WORDS * block + lane];
    sums[lane] = uint(bitCount(bits));
    barrier();
    uint set = block / set_blocks;
    uint at = sets[set].base + starts[block];
    for (uint i = 0u; i < lane; ++i) at += sums[i];
    uint word = FIV_BLOCK_SAMPLES * (block % set_blocks) + 32u * lane;
    while (bits != 0u) {
        uint number = word + uint(findLSB(bits));
        bits &= bits - 1u;
        points[at] = FivPoint(-directions[number % rings] * radii[sets[set].radii_at + number / rings], set);
        samples[at] = FIV_BLOCK_SAMPLES * set_blocks * set + number;
        ++at;
    }
}
