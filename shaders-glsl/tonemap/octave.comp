// The next coarser level of a Gaussian pyramid: the binomial filter (1, 3, 3, 1) / 8 in both directions, every second sample.
// Sizes are halved and rounded up. Beyond the border the border repeats.
#version 460
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2D fine;
layout(binding = 1, r32f) uniform writeonly image2D coarse;

const float WEIGHTS[4] = float[4](0.125, 0.375, 0.375, 0.125);

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(at, imageSize(coarse)))) return;
    ivec2 last = textureSize(fine, 0) - 1;
    precise float sum = 0.0;
    for (int y = 0; y < 4; ++y) {
        precise float line = 0.0;
        for (int x = 0; x < 4; ++x) {
            line += WEIGHTS[x] * texelFetch(fine, clamp(2 * at + ivec2(x, y) - 1, ivec2(0), last), 0).r;
        }
        sum += WEIGHTS[y] * line;
    }
    imageStore(coarse, at, vec4(sum));
}
