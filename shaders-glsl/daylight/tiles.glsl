// The tiles of a bake in device memory, and the light of one texel (techniques::daylight::layer).
#ifndef LIB_DAY_TILES
#define LIB_DAY_TILES

struct DayTile {
    uint mask;           // first word of a bit for each texel, and of the number of texels before each of these words
    uint mask_words;
    uint columns;        // texels
    uint first_word[3];  // of the light of the sun, of the sky, of lamps
    uint wide[3];        // images of 16-bit floats
    uint narrow[3];      // images of signed bytes
    uint first[3];       // coefficient
    uint first_texel;    // number of texels in the tiles before
    uint hdr[3];         // images in BC6H, after those of bytes
    uint pairs[3];       // images in BC5 and BC4, which come last
    uint first_hdr[3];   // number of the first one among all images in BC6H
    uint first_pair[3];
};

layout(binding = 20, scalar) readonly buffer Tiles { DayTile tiles[]; };
layout(binding = 21, scalar) readonly buffer Words { uint words[]; };
// For each image of each tile the colour of one unit of its values, W/m².
layout(binding = 22, scalar) readonly buffer Coefficients { vec3 coefficients[]; };

// Images in blocks (techniques::daylight::pages): define DAY_BLOCKS for tiles that may have them.
#ifdef DAY_BLOCKS
layout(constant_id = 3) const uint BLOCKS = 0u;
layout(binding = 23) uniform sampler2DArray block_hdr;    // BC6H
layout(binding = 24) uniform sampler2DArray block_pairs;  // BC5: red and green
layout(binding = 25) uniform sampler2DArray block_blues;  // BC4: blue

// Column, row and layer of a texel of an image. `pages`: columns and rows of a layer, `square`: side of the square that an image has there.
ivec3 day_page_texel(uint slot, ivec2 pages, uint square, uvec2 inside) {
    uvec2 along = uvec2(pages) / square;
    uint on_page = slot % (along.x * along.y);
    return ivec3(uvec2(on_page % along.x, on_page / along.x) * square + inside, slot / (along.x * along.y));
}

// Adds the images in blocks of a layer. `first`: coefficient of the first one; `square`: side of a tile, rounded up to whole blocks.
void day_blocks(inout vec3 sum, inout vec3 other, uint tile, uint layer, uint first, uint square, uvec2 inside, uint second) {
    uint hdr = tiles[tile].hdr[layer];
    for (uint i = 0u; i < hdr; ++i) {
        ivec3 at = day_page_texel(tiles[tile].first_hdr[layer] + i, textureSize(block_hdr, 0).xy, square, inside);
        vec3 value = texelFetch(block_hdr, at, 0).rgb;
        sum += coefficients[first + i] * value;
        if (second != 0u) other += coefficients[second + first + i] * value;
    }
    uint pairs = tiles[tile].pairs[layer];
    for (uint i = 0u; i < pairs; ++i) {
        ivec3 at = day_page_texel(tiles[tile].first_pair[layer] + i, textureSize(block_pairs, 0).xy, square, inside);
        vec3 value = vec3(texelFetch(block_pairs, at, 0).rg, texelFetch(block_blues, at, 0).r);
        sum += coefficients[first + hdr + i] * value;
        if (second != 0u) other += coefficients[second + first + hdr + i] * value;
    }
}
#endif

// Number of a texel among those of its tile that are on a surface; NONE: it is on none. `inside`: from the corner of the tile.
uint day_texel(uint tile, uvec2 inside) {
    uint texel = inside.y * tiles[tile].columns + inside.x;
    uint word = texel / 32u;
    uint bits = words[tiles[tile].mask + word];
    uint bit = 1u << (texel % 32u);
    if ((bits & bit) == 0u) return NONE;
    return words[tiles[tile].mask + tiles[tile].mask_words + word] + bitCount(bits & (bit - 1u));
}

// Light of a texel.
struct DaySums {
    vec3 first;   // W/m²
    vec3 second;  // with the coefficients from `second` on; 0 if that is 0
    uint fetches; // values that were read, three colours each
};

// Adds the images of a layer at a texel, with their coefficients. Values of images may be negative, so rounding may leave a small negative sum.
void day_layer(inout DaySums sums, uint tile, uint layer, uint texel, uint second) {
    uint wide = tiles[tile].wide[layer];
    uint narrow = tiles[tile].narrow[layer];
    uint first = tiles[tile].first[layer];
    uint at = tiles[tile].first_word[layer] + texel * ((6u * wide + 3u * narrow + 3u) / 4u);
    uint half_at = 0u;
    for (uint i = 0u; i < wide; ++i) {
        vec3 value;
        for (uint c = 0u; c < 3u; ++c) {
            vec2 pair = unpackHalf2x16(words[at + half_at / 2u]);
            value[c] = (half_at & 1u) == 0u ? pair.x : pair.y;
            ++half_at;
        }
        sums.first += coefficients[first + i] * value;
        if (second != 0u) sums.second += coefficients[second + first + i] * value;
    }
    uint byte_at = 2u * half_at;
    for (uint i = 0u; i < narrow; ++i) {
        vec3 value;
        for (uint c = 0u; c < 3u; ++c) {
            int word = int(words[at + byte_at / 4u]);
            value[c] = float(bitfieldExtract(word, int(8u * (byte_at & 3u)), 8));
            ++byte_at;
        }
        sums.first += coefficients[first + wide + i] * value;
        if (second != 0u) sums.second += coefficients[second + first + wide + i] * value;
    }
    sums.fetches += wide + narrow;
}

// Irradiance at a texel by all layers, W/m².
vec3 day_irradiance(uint tile, uint texel) {
    DaySums sums = DaySums(vec3(0.0), vec3(0.0), 0u);
    for (uint layer = 0u; layer < 3u; ++layer) day_layer(sums, tile, layer, texel, 0u);
    return sums.first;
}

#endif
