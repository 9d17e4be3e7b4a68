// Starts short paths at the listed pixels, which gather at full resolution (igi/refine.comp).
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/screen.glsl"
#include "lib/gbuffer.glsl"
#include "lib/vpl.glsl"
#include "igi/near.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1) uniform sampler2D normal;
layout(binding = 2) uniform sampler2D depth;
layout(binding = 3, scalar) readonly buffer Unmatched { uint unmatched_count; uint unmatched[]; }; // pixels, x | y << 16

layout(push_constant, scalar) uniform Push {
    uint first;   // first list entry
    uint count;   // list entries
    uint number;  // which path of the pixel
    uint paths;   // paths per pixel
};

void main() {
    uint slot = gl_GlobalInvocationID.x;
    if (slot >= count) return;
    if (first + slot >= unmatched_count) {
        // The passes that follow run whole workgroups, also beyond the end of the list.
        near_paths[slot].alive = 0u;
        return;
    }
    uint salt = unmatched[first + slot];
    ivec2 pixel = ivec2(salt & 0xffffu, salt >> 16u);
    float z = texelFetch(depth, pixel, 0).r;
    NearPath path;
    path.position = screen_position(view, pixel, 1.0, z);
    path.alive = 1u;
    path.normal = decode_normal(texelFetch(normal, pixel, 0));
    path.salt = salt;
    path.side = path.normal;
    path.gap = surface_step(view, path.position, z);
    path.position = stepped_back(view, path.position, path.gap);
    path.weight = vec3(1.0 / float(paths));
    path.light = number == 0u ? vec3(0.0) : near_paths[slot].light;
    path.half_light = 0.0;
    near_paths[slot] = path;
}
