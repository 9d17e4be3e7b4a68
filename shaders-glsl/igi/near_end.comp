// Adds the light of the short paths to the irradiance of the visible surfaces, or stores it apart for the filter.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "igi/soft.glsl"
#include "igi/near.glsl"

layout(local_size_x = 64) in;

layout(constant_id = 0) const uint apart = 0u; // 1: `irradiance` gets this light alone; a: difference between both halves of the paths

layout(binding = 0, rgba32f) uniform image2D irradiance;

layout(push_constant, scalar) uniform Push {
    uint first; // first texel
    uint count; // texels
    uint paths; // paths per texel
};

void main() {
    uint slot = gl_GlobalInvocationID.x;
    if (slot >= count) return;
    int width = imageSize(irradiance).x;
    ivec2 texel = ivec2(int(first + slot) % width, int(first + slot) / width);
    NearPath path = near_paths[slot];
    if (apart != 0u) {
        float all = dot(path.light, SOFT_LUMINANCE);
        // A single path has no second half: its light is its noise.
        float difference = paths < 2u ? all : path.half_light + soft_side(paths - 1u, paths) * (all - path.half_light);
        imageStore(irradiance, texel, vec4(path.light, difference));
    } else {
        imageStore(irradiance, texel, imageLoad(irradiance, texel) + vec4(path.light, 0.0));
    }
}
