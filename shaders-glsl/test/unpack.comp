// Texels from a buffer into an image: inputs of tests.
#version 460
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0, scalar) readonly buffer Texels { vec4 texels[]; };
layout(binding = 1, rgba32f) uniform writeonly image2D target;
void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 extent = imageSize(target);
    if (all(lessThan(pixel, extent))) {
        imageStore(target, pixel, texels[pixel.y * extent.x + pixel.x]);
    }
}
