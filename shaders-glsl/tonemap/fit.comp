// Fits the light that a solver found to the display.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 8, local_size_y = 8) in;

// 0: the lower percentile becomes black and the upper one white. 1: the logarithm becomes the code of a display of the power 2.2; the median is half of white's,
// and the farther of both percentiles black or white (Mantiuk 2006, equation 26).
layout(constant_id = 0) const uint CODES = 0;

layout(binding = 0) uniform sampler2D light;
layout(binding = 1, scalar) readonly buffer Ends {
    uint value[2];  // bits of both percentiles
    uint rank[2];
} ends;
layout(binding = 2, scalar) readonly buffer Middle {
    uint value[2];
    uint rank[2];
} middle;
layout(binding = 3, r32f) uniform writeonly image2D display;

const float OCTAVES = 3.321928095;  // of a decade
const float LEAST = 0.05;           // decades from black to white, at least: noise of even pictures stays faint

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(at, imageSize(display)))) return;
    float l = log2(texelFetch(light, at, 0).r);
    float low = log2(uintBitsToFloat(ends.value[0]));
    float high = log2(uintBitsToFloat(ends.value[1]));
    float shown;
    if (CODES == 0u) {
        // Without contrast all is white, as the single luminance of a picture is to other operators.
        float black = exp2(low - high);
        shown = black < 1.0 ? max((exp2(l - high) - black) / (1.0 - black), 0.0) : 1.0;
    } else {
        float median = log2(uintBitsToFloat(middle.value[0]));
        float whole = max(2.0 * max(high - median, median - low), LEAST * OCTAVES);
        shown = pow(max(0.5 + (l - median) / whole, 0.0), 2.2);
    }
    imageStore(display, at, vec4(shown));
}
