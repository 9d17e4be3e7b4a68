// The pixel for which a texel of a coarse picture gathers.
#ifndef LIB_IGI_TEXEL
#define LIB_IGI_TEXEL

// The pixel in the middle of the texel's factor² pixels. With `scattered` its column changes from row to row of texels, and its row from
// column to column. One texel in `factor` then hits a thin axis-parallel object, and not all or none of them.
ivec2 texel_pixel(ivec2 texel, uint factor, bool scattered, ivec2 full) {
    ivec2 place = ivec2(factor / 2u);
    if (scattered) {
        // The remainder of a division in floating point, because CPU drivers do not vectorise integer division.
        vec2 number = vec2(texel.yx + 2 * texel);
        place = ivec2(number - float(factor) * floor((number + 0.5) / float(factor)));
    }
    return min(texel * int(factor) + place, full - 1);
}

#endif
