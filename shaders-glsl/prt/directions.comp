// Directional coefficients of the light of the samples, from the samples that their first rays meet.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/random.glsl"
#include "lib/sampling.glsl"
#include "lib/points.glsl"
#include "lib/brdf.glsl"
#include "prt/prt.glsl"
#include "prt/ray.glsl"
#include "prt/lobe.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) readonly buffer Met { uint met[]; };               // a row of each sample; NONE or PRT_LOST: no sample
layout(binding = 1, scalar) readonly buffer Radiosities { vec3 radiosities[]; };
layout(binding = 2, scalar) writeonly buffer Terms { vec3 terms[]; };          // PRT_LOBES of each sample

layout(push_constant, scalar) uniform Push {
    uint count;
    uint rays;         // of each sample
    uint seed;         // of the bake
};

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    vec3[PRT_LOBES] sums;
    for (uint k = 0u; k < PRT_LOBES; ++k) sums[k] = vec3(0.0);
    for (uint ray = 0u; ray < rays; ++ray) {
        uint other = met[i * rays + ray];
        if (other >= count) continue;
        float[PRT_LOBES] at = prt_zernike(prt_ray(i, ray, seed).xy);
        for (uint k = 0u; k < PRT_LOBES; ++k) sums[k] += at[k] * radiosities[other];
    }
    for (uint k = 0u; k < PRT_LOBES; ++k) terms[PRT_LOBES * i + k] = sums[k] / (BRDF_PI * float(rays));
}
