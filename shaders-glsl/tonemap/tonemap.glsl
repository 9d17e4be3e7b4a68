// What all tone mapping shaders agree on.

const uint TONEMAP_ASHIKHMIN = 0;  // export
const uint TONEMAP_REINHARD = 1;  // export
const uint TONEMAP_BILATERAL = 2;  // export
const uint TONEMAP_LINEAR = 3;  // export
const uint TONEMAP_REINHARD_GLOBAL = 4;  // export
const uint TONEMAP_ACES = 5;  // export
const uint TONEMAP_AGX = 6;  // export
const uint TONEMAP_NEUTRAL = 7;  // export
const uint TONEMAP_DRAGO = 8;  // export
// Display luminance is in `adaptation` already.
const uint TONEMAP_SOLVED = 9;  // export

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

// Pixels of a column that one invocation has, where each is little work.
const uint TONEMAP_ROWS = 64;  // export
const uint TONEMAP_CURVE_ROWS = 4;  // export

const float TONEMAP_SMALLEST = 1e-30;
const float TONEMAP_LARGEST = 1e18;

// No NaN, nothing negative, nothing infinite: comparisons with NaN are false.
float tonemap_clean(float v) {
    return v > 0.0 ? min(v, TONEMAP_LARGEST) : 0.0;
}

vec3 tonemap_clean(vec3 v) {
    return vec3(tonemap_clean(v.r), tonemap_clean(v.g), tonemap_clean(v.b));
}

// What a + b leaves behind when it is rounded to `sum`.
float tonemap_rest(float a, float b, float sum) {
    precise float second = sum - a;
    precise float rest = (a - (sum - second)) + (b - second);
    return rest;
}

// weight * v in a part without rounding, which is returned, and what is missing, which is added to `rest`. `high` has 12 bits, `low` is the
// rest of the weight.
float tonemap_product(float v, float high, float low, inout float rest) {
    float upper = uintBitsToFloat(floatBitsToUint(v) & 0xFFFFF000u);
    precise float product = high * upper;
    precise float missing = high * (v - upper) + low * v;
    precise float sum = rest + missing;
    rest = sum;
    return product;
}

// 0.2126 R + 0.7152 G + 0.0722 B, of Rec. 709, rounded once: of an even picture, what plain sums lose would be seen. A CPU gets the same bits by
// 64 bits rounded to 32.
float tonemap_luminance(vec3 color) {
    float rest = 0.0;
    float r = tonemap_product(color.r, 0.21258544921875, 1.4550781088473741e-05, rest);
    float g = tonemap_product(color.g, 0.715087890625, 0.00011210937373107299, rest);
    float b = tonemap_product(color.b, 0.07220458984375, -4.589843683788786e-06, rest);
    precise float two = g + r;
    precise float three = two + b;
    precise float l = three + (rest + tonemap_rest(g, r, two) + tonemap_rest(two, b, three));
    return l < TONEMAP_SMALLEST ? 0.0 : min(l, TONEMAP_LARGEST);
}
