// What the visible surfaces reflect of the irradiance, and what they emit.
#version 460
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2D albedo;
layout(binding = 1) uniform sampler2D depth;
layout(binding = 2) uniform sampler2D emission;
layout(binding = 3, rgba32f) uniform image2D irradiance; // becomes zero where it was below
layout(binding = 4, rgba32f) uniform writeonly image2D total;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(total)))) return;
    if (texelFetch(depth, pixel, 0).r >= 1.0) {
        imageStore(total, pixel, vec4(0.0));
        return;
    }
    vec4 color = texelFetch(albedo, pixel, 0);
    vec3 light = max(imageLoad(irradiance, pixel).rgb, vec3(0.0));
    imageStore(irradiance, pixel, vec4(light, 1.0));
    // Unlit surfaces are shown as they are.
    vec3 reflected = color.a > 0.5 ? color.rgb * light / 3.14159265358979 : vec3(0.0);
    imageStore(total, pixel, vec4(reflected + texelFetch(emission, pixel, 0).rgb, 1.0));
}
