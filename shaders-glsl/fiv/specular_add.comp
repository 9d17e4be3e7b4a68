// Adds glossily reflected light, scaled by the share of it that occluders leave visible.
#version 460
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 8, local_size_y = 8) in;

layout(constant_id = 0) const uint SHARED = 1; // 1: there are occluders

layout(binding = 0) uniform sampler2D albedo;
layout(binding = 1) uniform sampler2D depth;
layout(binding = 2) uniform sampler2D whole; // reflected light of the cells without occluders, W/(sr·m²)
layout(binding = 3) uniform sampler2D left;  // the same with occluders
layout(binding = 4, rgba32f) uniform image2D reflected; // reflected light without occluders; is replaced by the light with occluders
layout(binding = 5, rgba32f) uniform image2D total;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(total)))) return;
    // Unlit surfaces reflect nothing.
    bool none = texelFetch(depth, pixel, 0).r >= 1.0 || texelFetch(albedo, pixel, 0).a <= 0.5;
    vec3 light = none ? vec3(0.0) : imageLoad(reflected, pixel).rgb;
    if (SHARED != 0u && !none) {
        vec3 of = texelFetch(whole, pixel, 0).rgb;
        // A channel without light keeps its value.
        light *= mix(vec3(1.0), clamp(texelFetch(left, pixel, 0).rgb / max(of, vec3(1e-37)), 0.0, 1.0), greaterThan(of, vec3(0.0)));
    }
    imageStore(reflected, pixel, vec4(light, 1.0));
    if (!none) imageStore(total, pixel, imageLoad(total, pixel) + vec4(light, 0.0));
}
