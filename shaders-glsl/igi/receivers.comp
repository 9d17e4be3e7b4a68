// Depth of the surfaces for which indirect light is gathered: the others count as background.
#version 460
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2D albedo; // a: 0 on unlit surfaces
layout(binding = 1) uniform sampler2D depth;
layout(binding = 2, r32f) uniform writeonly image2D received; // linear depth / far; 1: nothing is gathered

layout(push_constant, scalar) uniform Push {
    uint all; // 1: also for surfaces that show none of it (unlit and black ones, mirrors), whose texels others beside them take: a
              // lamp's pane in a ceiling
};

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(received)))) return;
    vec4 color = texelFetch(albedo, pixel, 0);
    bool receives = all != 0u || (color.a > 0.5 && color.rgb != vec3(0.0));
    imageStore(received, pixel, vec4(receives ? texelFetch(depth, pixel, 0).r : 1.0));
}
