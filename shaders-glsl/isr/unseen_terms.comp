// The terms of the mean radiance of the surfaces in the picture, whose mip levels are their means (isr/unseen.comp).
#version 460
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2D sender;  // rgb radiance, a mask
layout(binding = 1) uniform sampler2D albedo;  // coarse
layout(binding = 2) uniform sampler2D lamps;   // a: share of the hemisphere in which rays meet no surface
layout(binding = 3, rgba16f) uniform writeonly image2D light;  // rgb radiance times mask, a mask
layout(binding = 4, rgba16f) uniform writeonly image2D kept;   // share of light that returns to surfaces, times mask

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(texel, imageSize(light)))) return;
    vec4 own = texelFetch(sender, texel, 0);
    float closed = 1.0 - clamp(texelFetch(lamps, texel, 0).a, 0.0, 1.0);
    imageStore(light, texel, vec4(own.rgb * own.a, own.a));
    imageStore(kept, texel, vec4(texelFetch(albedo, texel, 0).rgb * closed * own.a, 0.0));
}
