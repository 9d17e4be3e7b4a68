// One level and layer of an image: (x, y, tag, 1)
#version 460
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0, rgba32f) uniform writeonly image2D image_out;
layout(push_constant, scalar) uniform Push { float tag; };
void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(image_out)))) return;
    imageStore(image_out, pixel, vec4(pixel, tag, 1.0));
}
