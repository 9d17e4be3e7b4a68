// What the fast bilateral filter knows of a block of pixels: the mean of the values up to the block's mean, the mean of those above it,
// and how many pixels each stands for. So a block across an edge keeps both sides.
#version 460
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2D logarithm;
layout(binding = 1, rgba32f) uniform writeonly image2D blocks;  // mean and number of the lower, mean and number of the upper

layout(push_constant, scalar) uniform Push {
    int side;  // pixels of a block
    int skip;  // every skip-th pixel of a block is looked at
};

void main() {
    ivec2 block = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(block, imageSize(blocks)))) {
        return;
    }
    ivec2 first = block * side;
    ivec2 end = min(first + side, textureSize(logarithm, 0));
    float sum = 0.0;
    float count = 0.0;
    for (int y = first.y; y < end.y; y += skip) {
        for (int x = first.x; x < end.x; x += skip) {
            sum += texelFetch(logarithm, ivec2(x, y), 0).r;
            count += 1.0;
        }
    }
    float mean = sum / count;
    vec2 lower = vec2(0.0);
    vec2 upper = vec2(0.0);
    for (int y = first.y; y < end.y; y += skip) {
        for (int x = first.x; x < end.x; x += skip) {
            float value = texelFetch(logarithm, ivec2(x, y), 0).r;
            if (value <= mean) {
                lower += vec2(value, 1.0);
            } else {
                upper += vec2(value, 1.0);
            }
        }
    }
    // A block that the border cuts stands for a whole one: the edge is repeated.
    float whole = float(side * side) / count;
    vec4 result = vec4(mean, 0.0, mean, 0.0);
    if (lower.y > 0.0) {
        result.xy = vec2(lower.x / lower.y, lower.y * whole);
    }
    if (upper.y > 0.0) {
        result.zw = vec2(upper.x / upper.y, upper.y * whole);
    }
    imageStore(blocks, block, result);
}
