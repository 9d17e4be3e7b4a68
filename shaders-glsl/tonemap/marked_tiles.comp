// The local component of the important pixels of the listed tiles, a workgroup for each.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 2) uniform sampler2D importance;
layout(binding = 3, scalar) readonly buffer Count { uint count; };
layout(binding = 4, scalar) readonly buffer Tiles { uint tiles[]; };
layout(binding = 5, r32f) uniform writeonly image2D adapted;
#include "tonemap/list.glsl"
#include "tonemap/local.glsl"

void main() {
    uint index = list_group();
    if (index >= count) return;
    ivec2 pixel = 8 * ivec2(tiles[index] & 0xFFFFu, tiles[index] >> 16) + ivec2(gl_LocalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(adapted)))) return;
    if (texelFetch(importance, pixel, 0).r != 0.0) imageStore(adapted, pixel, vec4(tonemap_local(pixel)));
}
