// One direction of a separable Gaussian. Texels beyond the border repeat the border; the weights are divided by their sum.
#version 460
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2D color;
layout(binding = 1, rgba16f) uniform writeonly image2D blurred;

layout(push_constant, scalar) uniform Push {
    ivec2 direction;  // (1, 0) or (0, 1)
    int radius;       // taps to each side
    float sigma;      // pixels
};

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 extent = imageSize(blurred);
    if (any(greaterThanEqual(pixel, extent))) {
        return;
    }
    vec4 sum = vec4(0.0);
    float weights = 0.0;
    for (int i = -radius; i <= radius; ++i) {
        float w = exp(-float(i * i) / (2.0 * sigma * sigma));
        sum += w * texelFetch(color, clamp(pixel + i * direction, ivec2(0), extent - 1), 0);
        weights += w;
    }
    imageStore(blurred, pixel, sum / weights);
}
