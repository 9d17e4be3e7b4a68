// Depth as a shader sees it: plain, and compared with a reference
#version 460
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0) uniform sampler2D depth;
layout(binding = 1) uniform sampler2DShadow shadow;
layout(binding = 2, rgba32f) uniform writeonly image2D image_out;
layout(push_constant, scalar) uniform Push { float reference; };
void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 extent = imageSize(image_out);
    if (any(greaterThanEqual(pixel, extent))) return;
    vec2 uv = (vec2(pixel) + 0.5) / vec2(extent);
    float lit = textureLod(shadow, vec3(uv, reference), 0.0);
    imageStore(image_out, pixel, vec4(texelFetch(depth, pixel, 0).r, lit, 0.0, 1.0));
}
