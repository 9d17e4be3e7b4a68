// First entry of the samples of each block in the lists of its geometry, and the numbers of workgroups for the passes
// that compute the samples. One workgroup per geometry.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "fiv/online.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) readonly buffer Jobs { FivJob jobs[]; };
layout(binding = 1, scalar) readonly buffer Counts { uint counts[]; };
layout(binding = 2, scalar) writeonly buffer Starts { uint starts[]; }; // of each block
layout(binding = 3, scalar) writeonly buffer Groups { uint groups[]; }; // six words for each batch: for cover.comp, and for passes with one invocation per point

layout(push_constant, scalar) uniform Push {
    uint each;   // most points of a batch
    uint chunks; // chunks of the directions of a point
};

shared uint sums[64];

void main() {
    uint lane = gl_LocalInvocationID.x;
    FivJob job = jobs[gl_WorkGroupID.x];
    uint strip = (job.blocks + 63u) / 64u;
    uint begin = min(lane * strip, job.blocks), end = min(begin + strip, job.blocks);
    uint sum = 0u;
    for (uint b = begin; b < end; ++b) sum += counts[job.block + b];
    sums[lane] = sum;
    barrier();
    uint at = 0u, total = 0u;
    for (uint i = 0u; i < 64u; ++i) {
        if (i < lane) at += sums[i];
        total += sums[i];
    }
    for (uint b = begin; b < end; ++b) {
        starts[job.block + b] = at;
        at += counts[job.block + b];
    }
    for (uint b = lane; b < job.batches; b += 64u) {
        uint points = total > b * each ? min(each, total - b * each) : 0u;
        uint out_at = 6u * (job.batch + b);
        groups[out_at] = points;
        groups[out_at + 1u] = chunks;
        groups[out_at + 2u] = 1u;
        groups[out_at + 3u] = (points + 63u) / 64u;
        groups[out_at + 4u] = 1u;
        groups[out_at + 5u] = 1u;
    }
}
