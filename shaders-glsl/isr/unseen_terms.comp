// The terms of the mean radiance of the surfaces in the picture, whose mip levels are their means (isr/unseen.comp).
#version 460
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2D sender;  // rgb radiance, a mask
layout(binding = 1) uniform sampler2D albedo;  // coarse
layout(binding = 2) uniform sampler2D lamps;   // a: share of the hemisphere in which rays meet no surface
layout(binding = 3, rgba16f) uniform writeonly image2D light;  // rgb radiance times mask, a coverage
layout(binding = 4, rgba16f) uniform writeonly image2D kept;   // share of light that returns to surfaces, times coverage

layout(push_constant, scalar) uniform Push {
    uint masked; // 1: materials have masks. 0: the mask is 1, and 0 where nothing is lit, so that it is the coverage too
};

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(texel, imageSize(light)))) return;
    vec4 own = texelFetch(sender, texel, 0);
    float closed = 1.0 - clamp(texelFetch(lamps, texel, 0).a, 0.0, 1.0);
    vec4 color = texelFetch(albedo, texel, 0);
    float coverage = own.a;
    float received = 1.0;
    if (masked != 0u) {
        coverage = color.a > 0.0 ? min(own.a / color.a, 1.0) : float(color.rgb != vec3(0.0));
        received = color.a;
    }
    imageStore(light, texel, vec4(own.rgb * own.a, coverage));
    imageStore(kept, texel, vec4(color.rgb * closed * own.a * received, 0.0));
}
