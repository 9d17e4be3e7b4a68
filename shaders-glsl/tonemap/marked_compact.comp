// The local component of the listed pixels, an invocation for each.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 64) in;

layout(binding = 2, scalar) readonly buffer Count { uint count; };
layout(binding = 3, scalar) readonly buffer Pixels { uint pixels[]; };  // x in the low 16 bits, y in the high ones
layout(binding = 4, r32f) uniform writeonly image2D adapted;
#include "tonemap/list.glsl"
#include "tonemap/local.glsl"

void main() {
    uint index = list_group() * 64u + gl_LocalInvocationID.x;
    if (index >= count) return;
    ivec2 pixel = ivec2(pixels[index] & 0xFFFFu, pixels[index] >> 16);
    imageStore(adapted, pixel, vec4(tonemap_local(pixel)));
}
