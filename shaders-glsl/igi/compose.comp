// The sum of all light: reflected irradiance, direct light, and the light in mirrors and glass.
#version 460
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 8, local_size_y = 8) in;

layout(constant_id = 0) const uint SHARP = 0; // 1: there are mirrors or glass

layout(binding = 0) uniform sampler2D albedo;
layout(binding = 1) uniform sampler2D depth;
layout(binding = 2, rgba32f) uniform image2D direct; // read; then written without the share of mirrors and glass
layout(binding = 3) uniform sampler2D irradiance;
layout(binding = 4) uniform sampler2D sharp; // rgb: radiance of the ray trees; a: share of the surface that is mirror or glass
layout(binding = 5, rgba32f) uniform writeonly image2D total;
layout(binding = 6, rgba32f) uniform writeonly image2D indirect;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(total)))) return;
    if (texelFetch(depth, pixel, 0).r >= 1.0) {
        imageStore(total, pixel, vec4(0.0));
        imageStore(indirect, pixel, vec4(0.0));
        return;
    }
    vec4 color = texelFetch(albedo, pixel, 0);
    vec4 tree = SHARP != 0u ? texelFetch(sharp, pixel, 0) : vec4(0.0);
    vec3 bounced = color.a * color.rgb * texelFetch(irradiance, pixel, 0).rgb * ((1.0 - tree.a) / 3.14159265358979); // ρ of [IGI 1]
    vec3 rough = imageLoad(direct, pixel).rgb * (1.0 - tree.a);
    imageStore(direct, pixel, vec4(rough, 1.0));
    imageStore(indirect, pixel, vec4(bounced, 1.0));
    imageStore(total, pixel, vec4(bounced + rough + tree.rgb, 1.0));
}
