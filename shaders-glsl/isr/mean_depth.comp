// Linear depth and share of geometry, whose mip levels become the mean depth of what is in the picture.
#version 460
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2D depth;
layout(binding = 1, rgba16f) uniform writeonly image2D moments;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(moments)))) {
        return;
    }
    float z = texelFetch(depth, pixel, 0).r;
    imageStore(moments, pixel, z < 1.0 ? vec4(z, 1.0, 0.0, 0.0) : vec4(0.0));
}
