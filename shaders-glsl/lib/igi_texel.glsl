// Which pixel a texel of a coarse picture stands for.
#ifndef LIB_IGI_TEXEL
#define LIB_IGI_TEXEL

// The pixel in the middle of factor² pixels; scattered: one whose column moves on from row to row of texels, and whose row moves on from
// column to column, so that a thin thing along either axis is met by one texel in `factor` and not by all or none.
ivec2 texel_pixel(ivec2 texel, uint factor, bool scattered, ivec2 full) {
    ivec2 place = ivec2(factor / 2u);
    if (scattered) {
        // The rest of a division; CPU drivers divide whole numbers one by one.
        vec2 number = vec2(texel.yx + 2 * texel);
        place = ivec2(number - float(factor) * floor((number + 0.5) / float(factor)));
    }
    return min(texel * int(factor) + place, full - 1);
}

#endif
