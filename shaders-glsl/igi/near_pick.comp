// Adds the light of one virtual light at the ends of short paths, picked from the light tree.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/random.glsl"
#include "lib/sampling.glsl"
#include "lib/trace.glsl"
#include "lib/vpl.glsl"
#define VPL_NODES_BINDING 4
#include "igi/vpl_tree.glsl"
#include "igi/near.glsl"

layout(local_size_x = 64) in;

layout(binding = 3, scalar) readonly buffer Vpls { Vpl vpls[]; }; // sorted like the leaves of the tree

layout(push_constant, scalar) uniform Push {
    uint count;   // paths
    uint turn;    // index of the segment that led to the surface
    uint number;  // which path of the receiver
    uint leaves;  // of the light tree
    uint bounces; // maximum of bounces
    float least;  // min_d of the bounded geometry term, metres
    uint seed;
};

void main() {
    uint slot = gl_GlobalInvocationID.x;
    if (slot >= count || near_paths[slot].alive == 0u) return;
    NearPath path = near_paths[slot];
    vec3 above = path.position + path.side * path.gap;
    uvec4 words = pcg4d(uvec4(path.salt, number, turn, seed ^ 0x91cfu));
    float probability;
    uint k = vpl_pick(unit_float(words.x), path.position, path.normal, least, leaves, probability);
    // Skips a light whose path to the start of the short path would have more than `bounces` bounces.
    if (k == VPL_NO_PICK || vpls[k].depth + turn + 2u > bounces) return;
    Vpl vpl = vpls[k];
    vec3 light = vpl_irradiance(vpl, path.position, path.normal, least) / probability;
    vec3 to = vpl.position + vpl.normal * vpl.gap - above;
    if (light == vec3(0.0) || trace_any(Ray(above, 0.0, to, 0.99999), TRACE_SHADOW, words.y)) return;
    near_paths[slot].light = path.light + path.weight * light;
}
