// One level of the light tree: each node gets the bounds of its two children.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/vpl.glsl"
#include "igi/vpl_tree.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) buffer Nodes { VplNode nodes[]; };

layout(push_constant, scalar) uniform Push {
    uint first; // first node of the level; the level has `first` nodes
};

// Cosine of the sum of two angles that are given by their cosines; -1 if the sum is 180 degrees or more.
float cosine_of_sum(float a, float b) {
    if (a + b <= 0.0) return -1.0;
    return a * b - sqrt(max(1.0 - a * a, 0.0) * max(1.0 - b * b, 0.0));
}

void main() {
    uint at = first + gl_GlobalInvocationID.x;
    if (at >= 2u * first) return;
    VplNode a = nodes[2u * at], b = nodes[2u * at + 1u];
    VplNode node = a.flux > 0.0 ? a : b;
    if (a.flux > 0.0 && b.flux > 0.0) {
        node.low = min(a.low, b.low);
        node.high = max(a.high, b.high);
        node.flux = a.flux + b.flux;
        node.lights = a.lights + b.lights;
        vec3 sum = a.axis + b.axis;
        float size = length(sum);
        node.cos_spread = -1.0;
        if (size > 1e-3) {
            node.axis = sum / size;
            float widest = min(cosine_of_sum(clamp(dot(node.axis, a.axis), -1.0, 1.0), a.cos_spread),
                cosine_of_sum(clamp(dot(node.axis, b.axis), -1.0, 1.0), b.cos_spread));
            // A margin for rounding: the cone must contain all normals.
            node.cos_spread = max(widest - 1e-5, -1.0);
        }
    }
    nodes[at] = node;
}
