// Sums the layers and the first two levels of an array at one texel of the second level
#version 460
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0) uniform sampler2DArray image;
layout(binding = 1, rgba32f) uniform writeonly image2D sum_out;
void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(sum_out)))) return;
    vec4 sum = vec4(0.0);
    for (int layer = 0; layer < textureSize(image, 0).z; ++layer)
        sum += texelFetch(image, ivec3(pixel * 2, layer), 0) + texelFetch(image, ivec3(pixel, layer), 1);
    imageStore(sum_out, pixel, sum);
}
