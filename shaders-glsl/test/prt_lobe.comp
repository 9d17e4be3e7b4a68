// Lobes of glossy surfaces, and the radiance over them.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/brdf.glsl"
#include "prt/prt.glsl"
#include "prt/lobe.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) readonly buffer Asked { vec4 asked[]; };    // to the viewer; width of GGX. The normal is the z axis.
layout(binding = 1, scalar) readonly buffer Terms { vec3 terms[]; };    // coefficients of the radiance
layout(binding = 2, scalar) writeonly buffer Found { vec4 found[]; };   // dominant direction, mean cosine; mean square, radiance

layout(push_constant, scalar) uniform Push { uint count; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    vec3 normal = vec3(0.0, 0.0, 1.0);
    PrtLobe lobe = prt_lobe(normal, asked[i].xyz, asked[i].w);
    vec3[PRT_LOBES] of;
    for (uint k = 0u; k < PRT_LOBES; ++k) of[k] = terms[k];
    found[2u * i] = vec4(lobe.dominant, lobe.cosine);
    found[2u * i + 1u] = vec4(lobe.square, prt_radiance(lobe, normal, vec3(1.0), of));
}
