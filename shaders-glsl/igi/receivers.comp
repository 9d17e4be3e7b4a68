// Depth of the surfaces for which indirect light is gathered. All other surfaces become background.
#version 460
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2D albedo; // a: 0 on unlit surfaces
layout(binding = 1) uniform sampler2D depth;
layout(binding = 2, r32f) uniform writeonly image2D received; // linear depth / far; 1: nothing is gathered

layout(push_constant, scalar) uniform Push {
    uint all; // 1: also for surfaces that reflect no diffuse light (unlit and black surfaces, mirrors), because filters read their texels
              // for the surfaces around them, for example for the ceiling around a lamp
};

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(received)))) return;
    vec4 color = texelFetch(albedo, pixel, 0);
    bool receives = all != 0u || (color.a > 0.5 && color.rgb != vec3(0.0));
    imageStore(received, pixel, vec4(receives ? texelFetch(depth, pixel, 0).r : 1.0));
}
