// What all tone mapping shaders agree on.

const uint TONEMAP_ASHIKHMIN = 0;  // export
const uint TONEMAP_REINHARD = 1;  // export
const uint TONEMAP_BILATERAL = 2;  // export
const uint TONEMAP_LINEAR = 3;  // export
const uint TONEMAP_REINHARD_GLOBAL = 4;  // export
const uint TONEMAP_ACES = 5;  // export
const uint TONEMAP_AGX = 6;  // export
const uint TONEMAP_NEUTRAL = 7;  // export

// Of the luminances of a picture, as the operators use them. All after the exposure.
struct TonemapStatistics {
    float low;          // L_min
    float high;         // L_max
    float log_average;
    uint frames;        // frames seen; 0: the other fields mean nothing yet
    // Of the last frame alone, without adaptation in time.
    float frame_low;
    float frame_high;
    float frame_log_average;
    float scale;        // factor of luminance and colour after the exposure: 1, or 1 / log-average of the picture as it came
};

const float TONEMAP_SMALLEST = 1e-30;
const float TONEMAP_LARGEST = 1e18;

// No NaN, nothing negative, nothing infinite: comparisons with NaN are false.
float tonemap_clean(float v) {
    return v > 0.0 ? min(v, TONEMAP_LARGEST) : 0.0;
}

vec3 tonemap_clean(vec3 v) {
    return vec3(tonemap_clean(v.r), tonemap_clean(v.g), tonemap_clean(v.b));
}

// Rec. 709; without fused operations, so that a CPU gets the same bits.
float tonemap_luminance(vec3 color) {
    precise float r = 0.2126 * color.r;
    precise float g = 0.7152 * color.g;
    precise float b = 0.0722 * color.b;
    precise float sum = r + g;
    precise float l = sum + b;
    return l < TONEMAP_SMALLEST ? 0.0 : min(l, TONEMAP_LARGEST);
}
