// Copies the virtual lights in sorted order, and writes the leaves of the light tree.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/vpl.glsl"
#include "igi/vpl_tree.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) readonly buffer Keys { uvec2 keys[]; };
layout(binding = 1, scalar) readonly buffer Vpls { Vpl vpls[]; };
layout(binding = 2, scalar) writeonly buffer Ordered { Vpl ordered[]; };
layout(binding = 3, scalar) writeonly buffer Nodes { VplNode nodes[]; };

layout(push_constant, scalar) uniform Push {
    uint total;
    uint leaves; // a power of two
};

void main() {
    uint at = gl_GlobalInvocationID.x;
    if (at >= leaves) return;
    VplNode node = VplNode(vec3(0.0), 0.0, vec3(0.0), 1.0, vec3(0.0, 1.0, 0.0), 0u);
    if (at < total) {
        Vpl vpl = vpls[keys[at].y];
        ordered[at] = vpl;
        node = VplNode(vpl.position, dot(vpl.flux, vec3(1.0)), vpl.position, 1.0, vpl.normal, vpl.flux == vec3(0.0) ? 0u : 1u);
    }
    nodes[leaves + at] = node;
    // The root is node 1; node 0 is not part of the tree.
    if (at == 0u) nodes[0] = VplNode(vec3(0.0), 0.0, vec3(0.0), 1.0, vec3(0.0, 1.0, 0.0), 0u);
}
