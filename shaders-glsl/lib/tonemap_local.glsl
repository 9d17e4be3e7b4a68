// The local component by its definition, one pixel at a time: any number of texel fetches of `luminance`, and nothing of where it is
// called from. The includer declares `sampler2D luminance` before.
struct TonemapLocal {
    uint radius;     // Ashikhmin: largest s
    float contrast;  // Ashikhmin: largest local contrast
};

layout(binding = 1) uniform LocalBlock {
    TonemapLocal local;
};

// G_s: weights exp(-d² / 2 sigma²), sigma = s / 2.
float tonemap_average(ivec2 pixel, int s) {
    ivec2 last = textureSize(luminance, 0) - 1;
    precise float k = -2.0 / float(s * s);
    precise float sum = 0.0;
    precise float weights = 0.0;
    for (int y = -s; y <= s; ++y) {
        for (int x = -s; x <= s; ++x) {
            precise float w = exp(k * float(x * x + y * y));
            sum += w * texelFetch(luminance, clamp(pixel + ivec2(x, y), ivec2(0), last), 0).r;
            weights += w;
        }
    }
    precise float mean = sum / weights;
    return mean;
}

float tonemap_local(ivec2 pixel) {
    float adaptation = tonemap_average(pixel, 1);
    for (int s = 1; s <= int(local.radius); ++s) {
        float centre = s == 1 ? adaptation : tonemap_average(pixel, s);
        float surround = tonemap_average(pixel, 2 * s);
        if (!(abs(centre - surround) < local.contrast * centre)) break;
        adaptation = centre;
    }
    return adaptation;
}
