// Sort keys of the virtual lights: a Morton code that includes the direction of the normal, so that lights with near positions and similar
// normals get near keys. One workgroup.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/vpl.glsl"

layout(local_size_x = 128) in;

layout(binding = 0, scalar) readonly buffer Vpls { Vpl vpls[]; };
layout(binding = 1, scalar) writeonly buffer Keys { uvec2 keys[]; }; // key, number of the virtual light

layout(push_constant, scalar) uniform Push {
    uint total;
};

shared vec3 lowest[128];
shared vec3 highest[128];

// Spreads ten bits to every third bit of 30.
uint spread(uint v) {
    v = (v | v << 16u) & 0x030000ffu;
    v = (v | v << 8u) & 0x0300f00fu;
    v = (v | v << 4u) & 0x030c30c3u;
    return (v | v << 2u) & 0x09249249u;
}

// The dominant axis of a normal and its sign, 0 to 5.
uint facing(vec3 n) {
    vec3 size = abs(n);
    uint axis = size.x > size.y && size.x > size.z ? 0u : size.y > size.z ? 1u : 2u;
    return 2u * axis + (n[axis] < 0.0 ? 1u : 0u);
}

void main() {
    uint lane = gl_LocalInvocationID.x;
    vec3 low = vec3(1e30), high = vec3(-1e30);
    for (uint i = lane; i < total; i += 128u) {
        if (vpls[i].flux == vec3(0.0)) continue;
        low = min(low, vpls[i].position);
        high = max(high, vpls[i].position);
    }
    lowest[lane] = low;
    highest[lane] = high;
    barrier();
    for (uint i = 0u; i < 128u; ++i) {
        low = min(low, lowest[i]);
        high = max(high, highest[i]);
    }
    // All axes have the same scale, so that the cells are cubes.
    vec3 size = high - low;
    float scale = 511.999 / max(max(size.x, max(size.y, size.z)), 1e-20);
    for (uint i = lane; i < total; i += 128u) {
        Vpl vpl = vpls[i];
        uvec3 cell = uvec3(clamp((vpl.position - low) * scale, vec3(0.0), vec3(511.0)));
        uint place = spread(cell.x) << 2u | spread(cell.y) << 1u | spread(cell.z);
        // The key has the octant of the box first, then the normal, then the position within the octant.
        uint key = (place >> 24u) << 27u | facing(vpl.normal) << 24u | (place & 0xffffffu);
        keys[i] = uvec2(vpl.flux == vec3(0.0) ? 0xffffffffu : key, i);
    }
}
