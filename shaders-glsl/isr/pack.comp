// A view's G-buffer and what it sends, into one layer of the array images that isr/gather_view reads.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/gbuffer.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2D albedo;  // a: radiation mask
layout(binding = 1) uniform sampler2D normal;
layout(binding = 2) uniform sampler2D depth;
layout(binding = 3) uniform sampler2D color;  // radiance that is sent
layout(binding = 4, rgba16f) uniform writeonly image2D their_radiance;  // rgb times mask, a mask
layout(binding = 5, rgba16f) uniform writeonly image2D their_normal;    // decoded
layout(binding = 6, r32f) uniform writeonly image2D their_depth;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(their_depth)))) {
        return;
    }
    float z = texelFetch(depth, pixel, 0).r;
    // Alpha as passes/downsample_color has it. Background sends nothing.
    float mask = z < 1.0 ? texelFetch(albedo, pixel, 0).a : 0.0;
    imageStore(their_radiance, pixel, vec4(texelFetch(color, pixel, 0).rgb * mask, mask));
    imageStore(their_normal, pixel, vec4(z < 1.0 ? decode_normal(texelFetch(normal, pixel, 0)) : vec3(0.0), 0.0));
    imageStore(their_depth, pixel, vec4(z));
}
