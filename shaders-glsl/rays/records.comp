// Brings the corners of a shape's records to where they are in this frame: deformed vertices, or those of what does not move
// by itself after something else moved it.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/scene.glsl"

layout(local_size_x = 64) in;

const uint TRACE_REVERSED = 2u; // as in lib/trace_common.glsl, which needs materials

layout(binding = 0, scalar) buffer Records { vec4 records[]; };
layout(binding = 1, scalar) readonly buffer Indices { uint indices[]; };
layout(binding = 2, scalar) readonly buffer Positions { vec3 positions[]; };
layout(binding = 3, scalar) readonly buffer Instances { Instance instances[]; };
layout(push_constant, scalar) uniform Push {
    uint first; // record
    uint count;
    uint first_instance; // added to the instances of the records
    uint placed;         // 1: in world space, 0: in the space of the vertices
};

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    uint r = 3u * (first + i);
    uint instance = first_instance + floatBitsToUint(records[r + 1u].w);
    uint triangle = floatBitsToUint(records[r + 2u].w);
    uint at = instances[instance].first_index + 3u * triangle;
    for (uint corner = 0u; corner < 3u; ++corner) {
        vec3 p = positions[instances[instance].first_vertex + indices[at + corner]];
        if (placed != 0u) p = (instances[instance].world_from_object * vec4(p, 1.0)).xyz;
        records[r + corner].xyz = p;
    }
    if (placed != 0u) {
        uint surface = floatBitsToUint(records[r].w) & ~TRACE_REVERSED;
        bool mirrored = (instances[instance].flags & INSTANCE_FLIPPED) != 0u;
        records[r].w = uintBitsToFloat(surface | (mirrored ? TRACE_REVERSED : 0u));
    }
}
