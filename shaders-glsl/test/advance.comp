// next = previous + 1
#version 460
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0) uniform sampler2D previous;
layout(binding = 1, rgba32f) uniform writeonly image2D next;
void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(next)))) return;
    imageStore(next, pixel, texelFetch(previous, pixel, 0) + 1.0);
}
