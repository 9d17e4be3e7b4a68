// Senders with radiance times mask, so that their mip levels average surfaces and not the background between them.
#version 460
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2D sender;  // rgb radiance, a mask
layout(binding = 1, rgba16f) uniform writeonly image2D premultiplied;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(premultiplied)))) {
        return;
    }
    vec4 s = texelFetch(sender, pixel, 0);
    imageStore(premultiplied, pixel, vec4(s.rgb * s.a, s.a));
}
