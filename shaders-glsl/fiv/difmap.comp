// Irradiance for the normal of every texel of a cube map: a sum over the texels of the environment ([FIV 6]).
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "fiv/fiv.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0, scalar) readonly buffer Texels { FivTexel texels[]; };
layout(binding = 1, rgba32f) uniform image2DArray difmap; // W/m²

layout(push_constant, scalar) uniform Push {
    uint first; // texel of the environment
    uint count; // at most 24,576
};

const uint BLOCK = 64u; // sums of partial sums, so that rounding errors grow with the square root only

void main() {
    ivec3 at = ivec3(gl_GlobalInvocationID);
    ivec3 size = imageSize(difmap);
    if (any(greaterThanEqual(at, size))) return;
    vec3 normal = normalize(cube_direction(uint(at.z), (vec2(at.xy) + 0.5) / vec2(size.xy)));
    vec3 sum = first == 0u ? vec3(0.0) : imageLoad(difmap, at).rgb;
    for (uint block = 0u; block < count; block += BLOCK) {
        vec3 part = vec3(0.0);
        uint end = min(block + BLOCK, count);
        for (uint i = first + block; i < first + end; ++i) {
            part += texels[i].radiance * max(dot(normal, texels[i].area), 0.0); // [FIV 6]
        }
        sum += part;
    }
    imageStore(difmap, at, vec4(sum, 1.0));
}
