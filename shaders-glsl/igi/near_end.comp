// Adds the light of the short paths to the irradiance of the visible surfaces.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "igi/near.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, rgba32f) uniform image2D irradiance;

layout(push_constant, scalar) uniform Push {
    uint first; // first texel
    uint count; // texels
};

void main() {
    uint slot = gl_GlobalInvocationID.x;
    if (slot >= count) return;
    int width = imageSize(irradiance).x;
    ivec2 texel = ivec2(int(first + slot) % width, int(first + slot) / width);
    imageStore(irradiance, texel, imageLoad(irradiance, texel) + vec4(near_paths[slot].light, 0.0));
}
