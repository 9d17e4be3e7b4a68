// The attenuated gradient along the edges of pixels: the difference to the right and to the lower neighbour, times the mean attenuation of
// both pixels.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2D logarithm;
layout(binding = 1) uniform sampler2D attenuation;
layout(binding = 2, r32f) uniform writeonly image2D across;
layout(binding = 3, r32f) uniform writeonly image2D down;

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    ivec2 extent = imageSize(across);
    if (any(greaterThanEqual(at, extent))) return;
    // At the border the neighbour is the pixel itself, and the difference 0.
    ivec2 right = ivec2(min(at.x + 1, extent.x - 1), at.y);
    ivec2 below = ivec2(at.x, min(at.y + 1, extent.y - 1));
    float own = texelFetch(logarithm, at, 0).r;
    float factor = texelFetch(attenuation, at, 0).r;
    vec2 step = vec2(texelFetch(logarithm, right, 0).r, texelFetch(logarithm, below, 0).r) - own;
    vec2 mean = 0.5 * (factor + vec2(texelFetch(attenuation, right, 0).r, texelFetch(attenuation, below, 0).r));
    imageStore(across, at, vec4(step.x * mean.x));
    imageStore(down, at, vec4(step.y * mean.y));
}
