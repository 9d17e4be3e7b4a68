// The senders of the next gather: what was sent before the first gather, plus what the receivers reflect of what they got.
#version 460
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 8, local_size_y = 8) in;

// Whether the senders hold radiance times mask.
layout(constant_id = 0) const uint PREMULTIPLIED = 0;

layout(binding = 0) uniform sampler2D sender;    // before the first gather: rgb radiance, a mask
layout(binding = 1) uniform sampler2D albedo;    // coarse
layout(binding = 2) uniform sampler2D gathered;  // rgb for a white receiver
layout(binding = 3, rgba16f) uniform writeonly image2D next;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(next)))) {
        return;
    }
    vec4 first = texelFetch(sender, pixel, 0);
    vec3 reflected = texelFetch(albedo, pixel, 0).rgb * texelFetch(gathered, pixel, 0).rgb;
    reflected *= PREMULTIPLIED != 0 ? first.a : 1.0;
    imageStore(next, pixel, vec4(first.rgb + reflected, first.a));
}
