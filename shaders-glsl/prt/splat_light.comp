// Light of splats: the mean of their samples, by area and free share.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "prt/prt.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) readonly buffer Splats { PrtSplat splats[]; };
layout(binding = 1, scalar) readonly buffer Members { uint members[]; };     // samples, splat after splat
layout(binding = 2, scalar) readonly buffer Drawn { uint drawn[]; };         // numbers of splats
layout(binding = 3, scalar) readonly buffer Samples { PrtSample samples[]; };
layout(binding = 4, scalar) readonly buffer Irradiances { vec3 irradiances[]; };
layout(binding = 5, scalar) readonly buffer Visible { float visible[]; };
layout(binding = 6, scalar) writeonly buffer Values { vec4 values[]; };      // two for each: irradiance and weight; shares of lights

layout(push_constant, scalar) uniform Push {
    uint count;        // splats that are drawn
    uint samples_all;
    uint first_light;
    uint lights;       // at most PRT_SPREAD_LIGHTS
};

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    PrtSplat splat = splats[drawn[i]];
    vec3 light = vec3(0.0);
    vec4 seen = vec4(0.0);
    float whole = 0.0;
    for (uint k = 0u; k < splat.count; ++k) {
        uint s = members[splat.first + k];
        float weight = samples[s].weight;
        whole += weight;
        light += weight * irradiances[s];
        for (uint l = 0u; l < lights; ++l) seen[l] += weight * visible[(first_light + l) * samples_all + s];
    }
    values[2u * i] = vec4(light / whole, whole / float(splat.count));
    values[2u * i + 1u] = seen / whole;
}
