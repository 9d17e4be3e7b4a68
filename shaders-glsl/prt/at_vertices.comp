// Light at the vertices of all instances, gathered from the samples around them.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/scene.glsl"
#include "prt/prt.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) readonly buffer Samples { PrtSample samples[]; };
layout(binding = 1, scalar) uniform GridBlock { PrtGrid grid; };
layout(binding = 2, scalar) readonly buffer Starts { uint starts[]; };
layout(binding = 3, scalar) readonly buffer Order { uint order[]; };
layout(binding = 4, scalar) readonly buffer Irradiances { vec3 irradiances[]; };
layout(binding = 5, scalar) readonly buffer Visible { float visible[]; };
layout(binding = 6, scalar) readonly buffer Instances { Instance instances[]; };
layout(binding = 7, scalar) readonly buffer Positions { vec3 positions[]; };
layout(binding = 8, scalar) readonly buffer Normals { vec3 normals[]; };
layout(binding = 9, scalar) readonly buffer Meshes { PrtMesh meshes[]; };    // of all instances, and one at the end
layout(binding = 10, scalar) writeonly buffer Values { vec4 values[]; };     // two for each: irradiance; shares of lights

layout(push_constant, scalar) uniform Push {
    uint count;        // values
    uint mesh_count;
    uint samples_all;
    uint first_light;
    uint lights;       // at most PRT_SPREAD_LIGHTS
    float splat;       // standard deviation of the weights, in distances of samples
};

#include "prt/near.glsl"

void main() {
    uint slot = gl_GlobalInvocationID.x;
    if (slot >= count) return;
    // The last mesh that begins at or before the slot.
    uint low = 0u, high = mesh_count;
    while (high - low > 1u) {
        uint middle = (low + high) / 2u;
        if (meshes[middle].first <= slot) low = middle; else high = middle;
    }
    PrtMesh mesh = meshes[low];
    uint at = instances[low].first_vertex + (slot - mesh.first) / mesh.sides;
    vec3 position = (instances[low].world_from_object * vec4(positions[at], 1.0)).xyz;
    vec3 normal = instances[low].normal_from_object * normals[at];
    float size = length(normal);
    normal = size > 0.0 ? normal / size : vec3(0.0, 1.0, 0.0);
    if ((slot - mesh.first) % mesh.sides == 1u) normal = -normal;
    PrtNear found = near_samples(position, normal, PrtKernel(splat, samples_all, first_light, lights));
    values[2u * slot] = vec4(found.irradiance, found.nearest == NONE ? 0.0 : 1.0);
    values[2u * slot + 1u] = vec4(found.visible[0], found.visible[1], found.visible[2], found.visible[3]);
}
