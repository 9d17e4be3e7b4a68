// Fullsphere irradiance vector of the whole environment ([FIV 10]): one workgroup, which sums up in a fixed order.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "fiv/fiv.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) readonly buffer Texels { FivTexel texels[]; };
layout(binding = 1, scalar) writeonly buffer Fivs { float fivs[]; }; // x.rgb, y.rgb, z.rgb, W/m²

layout(push_constant, scalar) uniform Push { uint count; };

shared vec3 sums[3][64];

void main() {
    uint lane = gl_LocalInvocationID.x;
    vec3 x = vec3(0.0), y = vec3(0.0), z = vec3(0.0);
    for (uint i = lane; i < count; i += 64u) {
        FivTexel t = texels[i];
        x += t.radiance * t.area.x; // [FIV 10]
        y += t.radiance * t.area.y;
        z += t.radiance * t.area.z;
    }
    sums[0][lane] = x;
    sums[1][lane] = y;
    sums[2][lane] = z;
    barrier();
    for (uint step = 32u; step > 0u; step >>= 1u) {
        if (lane < step) {
            for (uint k = 0u; k < 3u; ++k) sums[k][lane] += sums[k][lane + step];
        }
        barrier();
    }
    if (lane < 9u) fivs[lane] = sums[lane / 3u][0][lane % 3u];
}
