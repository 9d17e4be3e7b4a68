// Reinhard and Devlin 2005. Whoever includes it has declared the buffers `receptor` and `statistics`.

struct TonemapReceptor {
    uint low[3];   // sums of the channels, 64 bits, in units of receptor_unit
    uint high[3];
    uint least;    // bits of the smallest and the largest response; they are ordered as floats, for none is negative
    uint largest;
};

struct TonemapReceptorSettings {
    float exposure;   // factor
    float intensity;  // exp(−f)
    float contrast;   // m; 0: from the key
    float chromatic;  // c
    float local;      // a
    float pixels;     // of the whole picture
};

// The unit of the sums: 2⁻³⁶ of a power of two that no channel exceeds, for a channel is at most 13.9 times the luminance.
float receptor_unit(float largest) {
    int exponent;
    frexp(max(largest, TONEMAP_SMALLEST), exponent);
    return ldexp(1.0, exponent + 4 - 36);
}
