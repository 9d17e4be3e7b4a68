// value = value / 2 + i + 1 for each item i of a range: the result shows lost items and another order.
#version 460
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0, rgba32f) uniform image2D sums;
layout(push_constant, scalar) uniform Push {
    uint tag;
    uint first;
    uint count;
};
void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(sums)))) return;
    vec4 value = imageLoad(sums, pixel);
    for (uint i = first; i < first + count; ++i) value = 0.5 * value + float(i + tag);
    imageStore(sums, pixel, value);
}
