// The bilateral filter of one pixel, by its definition and from blocks. Whoever includes it has declared `sampler2D logarithm` and
// `sampler2D blocks`.

struct TonemapBilateral {
    float space;  // −log2(e) / 2σ², of pixels
    float range;  // the same, of log10
    int reach;    // pixels to each side
    int side;     // pixels of a block; 1: each pixel by itself
};

// Base luminance.
float bilateral_literal(ivec2 pixel, TonemapBilateral b) {
    ivec2 last = textureSize(logarithm, 0) - 1;
    float centre = texelFetch(logarithm, pixel, 0).r;
    float sum = 0.0;
    float total = 0.0;
    for (int j = -b.reach; j <= b.reach; ++j) {
        for (int i = -b.reach; i <= b.reach; ++i) {
            float difference = texelFetch(logarithm, clamp(pixel + ivec2(i, j), ivec2(0), last), 0).r - centre;
            float weight = exp2(b.space * float(i * i + j * j) + b.range * difference * difference);
            sum += weight * difference;
            total += weight;
        }
    }
    return exp2((centre + sum / total) / 0.30102999566);
}

// The same from blocks: both of the block's means, at its centre; and the pixel itself.
float bilateral_fast(ivec2 pixel, TonemapBilateral b) {
    ivec2 last = textureSize(blocks, 0) - 1;
    float centre = texelFetch(logarithm, pixel, 0).r;
    // Divided so that negative numbers are rounded down too.
    ivec2 first = (pixel - b.reach + 1024 * b.side) / b.side - 1024;
    ivec2 end = (pixel + b.reach) / b.side;
    float sum = 0.0;
    float total = 1.0;
    for (int j = first.y; j <= end.y; ++j) {
        for (int i = first.x; i <= end.x; ++i) {
            vec2 away = vec2(ivec2(i, j) * b.side - pixel) + 0.5 * float(b.side - 1);
            vec4 block = texelFetch(blocks, clamp(ivec2(i, j), ivec2(0), last), 0);
            vec2 difference = block.xz - centre;
            vec2 weight = block.yw * exp2(b.space * dot(away, away) + b.range * difference * difference);
            sum += dot(weight, difference);
            total += weight.x + weight.y;
        }
    }
    return exp2((centre + sum / total) / 0.30102999566);
}
