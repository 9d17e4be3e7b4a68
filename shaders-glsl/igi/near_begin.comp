// Starts short paths at the visible surfaces.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/screen.glsl"
#include "lib/gbuffer.glsl"
#include "igi/texel.glsl"
#include "lib/vpl.glsl"
#include "igi/soft.glsl"
#include "igi/near.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1) uniform sampler2D normal;
layout(binding = 2) uniform sampler2D depth;

layout(push_constant, scalar) uniform Push {
    uvec2 extent; // texels
    uint first;   // first texel
    uint count;   // texels
    uint number;  // which path of the texel
    uint paths;   // paths per texel
    uint factor;  // pixels along the side of a texel
    uint scattered; // 1: the texel's pixel changes from texel to texel (igi/texel.glsl)
};

void main() {
    uint slot = gl_GlobalInvocationID.x;
    if (slot >= count) return;
    uvec2 texel = uvec2((first + slot) % extent.x, (first + slot) / extent.x);
    ivec2 pixel = texel_pixel(ivec2(texel), factor, scattered != 0u, textureSize(depth, 0));
    float z = texelFetch(depth, pixel, 0).r;
    NearPath path;
    path.position = screen_position(view, pixel, 1.0, z);
    path.alive = z < 1.0 ? 1u : 0u;
    path.normal = decode_normal(texelFetch(normal, pixel, 0));
    path.salt = texel.x | texel.y << 16u;
    path.side = path.normal;
    path.gap = surface_step(view, path.position, z);
    path.position = stepped_back(view, path.position, path.gap);
    path.weight = vec3(1.0 / float(paths));
    path.light = number == 0u ? vec3(0.0) : near_paths[slot].light;
    path.half_light = number == paths / 2u ? dot(path.light, SOFT_LUMINANCE) : near_paths[slot].half_light;
    near_paths[slot] = path;
}
