// Important pixels by multi-scale centre-surround contrast, the intensity channel of Itti and Koch's saliency (2000): the mean
// of |C - S| / (C + S) over centres on levels 0 to 2 of a Gaussian pyramid and surrounds three and four levels coarser, over a
// threshold. The relative contrast takes the place of their normalisation of maps: in [0, 1] whatever the range of the image,
// and of neighbours only.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2D levels[7];
#include "tonemap/importance.glsl"

// Level K at the centre of `pixel` of level 0, bilinearly, beyond the border the border.
#define LEVEL(K)                                                                       \
    float level_##K(ivec2 pixel) {                                                     \
        ivec2 last = textureSize(levels[K], 0) - 1;                                    \
        vec2 at = (vec2(pixel) + 0.5) / float(1 << K) - 0.5;                           \
        ivec2 low = ivec2(floor(at));                                                  \
        vec2 f = at - vec2(low);                                                       \
        ivec2 a = clamp(low, ivec2(0), last);                                          \
        ivec2 b = clamp(low + 1, ivec2(0), last);                                      \
        precise float top = (1.0 - f.x) * texelFetch(levels[K], a, 0).r                \
            + f.x * texelFetch(levels[K], ivec2(b.x, a.y), 0).r;                       \
        precise float bottom = (1.0 - f.x) * texelFetch(levels[K], ivec2(a.x, b.y), 0).r \
            + f.x * texelFetch(levels[K], b, 0).r;                                     \
        precise float value = (1.0 - f.y) * top + f.y * bottom;                        \
        return value;                                                                  \
    }

LEVEL(0)
LEVEL(1)
LEVEL(2)
LEVEL(3)
LEVEL(4)
LEVEL(5)
LEVEL(6)

// Halved before the sum, which then cannot overflow.
float contrast(float centre, float surround) {
    precise float sum = 0.5 * centre + 0.5 * surround;
    precise float difference = 0.5 * centre - 0.5 * surround;
    return sum > 0.0 ? abs(difference) / sum : 0.0;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(importance)))) return;
    float c0 = level_0(pixel);
    float c1 = level_1(pixel);
    float c2 = level_2(pixel);
    float s3 = level_3(pixel);
    float s4 = level_4(pixel);
    float s5 = level_5(pixel);
    float s6 = level_6(pixel);
    precise float saliency = (contrast(c0, s3) + contrast(c0, s4) + contrast(c1, s4) + contrast(c1, s5)
        + contrast(c2, s5) + contrast(c2, s6)) / 6.0;
    store_importance(pixel, saliency > threshold);
}
