// Adds what surfaces reflect glossily, by the share that occluders leave of it.
#version 460
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 8, local_size_y = 8) in;

layout(constant_id = 0) const uint SHARED = 1; // occluders hide something

layout(binding = 0) uniform sampler2D albedo;
layout(binding = 1) uniform sampler2D depth;
layout(binding = 2) uniform sampler2D whole; // reflected light of the cells, W/(sr·m²)
layout(binding = 3) uniform sampler2D left;  // as well without what is hidden
layout(binding = 4, rgba32f) uniform image2D reflected; // without occluders; becomes what they leave of it
layout(binding = 5, rgba32f) uniform image2D total;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(total)))) return;
    // Unlit surfaces are shown as they are.
    bool none = texelFetch(depth, pixel, 0).r >= 1.0 || texelFetch(albedo, pixel, 0).a <= 0.5;
    vec3 light = none ? vec3(0.0) : imageLoad(reflected, pixel).rgb;
    if (SHARED != 0u && !none) {
        vec3 of = texelFetch(whole, pixel, 0).rgb;
        // Where a channel has no light, nothing is to be hidden.
        light *= mix(vec3(1.0), clamp(texelFetch(left, pixel, 0).rgb / max(of, vec3(1e-37)), 0.0, 1.0), greaterThan(of, vec3(0.0)));
    }
    imageStore(reflected, pixel, vec4(light, 1.0));
    if (!none) imageStore(total, pixel, imageLoad(total, pixel) + vec4(light, 0.0));
}
