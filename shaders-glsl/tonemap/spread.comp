// A map of important pixels found at reduced size, brought to full size: each pixel takes the value of its box.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 8, local_size_y = 8) in;

layout(constant_id = 0) const uint HAS_MASK = 0;
layout(binding = 0) uniform sampler2D small;
layout(binding = 1) uniform sampler2D mask; // any image of that size where HAS_MASK is 0
layout(binding = 2, r32f) uniform writeonly image2D importance;

layout(push_constant, scalar) uniform Push {
    uint factor;
};

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(importance)))) return;
    float important = texelFetch(small, pixel / int(factor), 0).r;
    if (HAS_MASK != 0u && texelFetch(mask, pixel, 0).r > 0.5) important = 1.0;
    imageStore(importance, pixel, vec4(important));
}
