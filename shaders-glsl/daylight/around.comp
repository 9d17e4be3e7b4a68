// What the texels of a face show: a guide for the look-up of their light (decode.comp).
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/gbuffer.glsl"
#include "daylight/cube.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2D depth;
layout(binding = 1) uniform sampler2D normal;
layout(binding = 2, scalar) writeonly buffer Around { CubeTexel around[]; };

layout(push_constant, scalar) uniform Push {
    uint side;   // of a face, texels
    uint face;
    float far;   // of the view, metres
};

void main() {
    uvec2 texel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(texel, uvec2(side)))) return;
    float z = texelFetch(depth, ivec2(texel), 0).r;
    CubeTexel seen = CubeTexel(0.0, 0u);
    if (z < BACKGROUND_DEPTH) {
        vec3 n = decode_normal(texelFetch(normal, ivec2(texel), 0));
        seen = CubeTexel(z * far, packSnorm2x16(octahedral_encode(n)));
    }
    around[texel.y * (6u * side) + face * side + texel.x] = seen;
}
