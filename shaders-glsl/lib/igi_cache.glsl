// Irradiance in space for the surfaces at the ends of trees: a hashed grid of cells, each for one place and one way to face, with the
// irradiance at one point (after the instant caching of Debattista et al., Instant Caching for Interactive Global Illumination, 2009,
// and the hashed cells of Binder et al., Massively Parallel Path Space Filtering, 2019).
#ifndef LIB_IGI_CACHE
#define LIB_IGI_CACHE

// Places in the table: a power of two, and twice as many as there may be cells.
const uint CACHE_SLOTS = 262144u; // export
// Cells at most. With more the cache gives up, and every surface gathers for itself.
const uint CACHE_CELLS = 131072u; // export
const uint CACHE_EMPTY = 0xffffffffu;
// Places that are looked at for a key.
const uint CACHE_PROBES = 1024u;

struct CacheCell {
    vec3 position; // of the node that stands for the cell, metres
    float gap;
    vec3 normal;
    uint node;     // its number: the least of those in the cell, whatever the order in which they come
    vec3 light;    // irradiance, W/m²
};

layout(binding = 80, scalar) buffer CacheKeys { uint cache_keys[]; };
layout(binding = 81, scalar) buffer CacheCells { CacheCell cache_cells[]; };
layout(binding = 82, scalar) buffer CacheList { uint cache_count; uint cache_list[]; }; // places of cells, in any order

// Which of 30 ways a normal looks: for each side of a cube its middle and the four parts around it. Normals along an axis are far
// from the borders.
uint cache_facing(vec3 n) {
    vec3 size = abs(n);
    uint axis = size.x > size.y && size.x > size.z ? 0u : size.y > size.z ? 1u : 2u;
    vec3 turned = axis == 0u ? n.yzx : axis == 1u ? n.zxy : n;
    vec2 off = turned.xy / abs(turned.z);
    vec2 most = abs(off);
    uint part = max(most.x, most.y) < 0.45 ? 0u : most.x > most.y ? (off.x > 0.0 ? 1u : 2u) : (off.y > 0.0 ? 3u : 4u);
    return (2u * axis + (turned.z < 0.0 ? 1u : 0u)) * 5u + part;
}

// Nine bits an axis: a cell's side is at least a 500th of the diagonal.
uint cache_key(ivec3 cell, uint facing) {
    uvec3 c = uvec3(clamp(cell, ivec3(0), ivec3(511)));
    return c.x | c.y << 9u | c.z << 18u | facing << 27u;
}

ivec3 cache_cell(vec3 position, vec3 low, float side) {
    return ivec3(floor((position - low) / side));
}

uint cache_hash(uint key) {
    // lowbias32 (Wellons 2018).
    key ^= key >> 16u;
    key *= 0x7feb352du;
    key ^= key >> 15u;
    key *= 0x846ca68bu;
    key ^= key >> 16u;
    return key % CACHE_SLOTS;
}

// Place of a key in the table, or CACHE_EMPTY.
uint cache_find(uint key) {
    uint slot = cache_hash(key);
    for (uint i = 0u; i < CACHE_PROBES; ++i) {
        uint there = cache_keys[slot];
        if (there == key) return slot;
        if (there == CACHE_EMPTY) return CACHE_EMPTY;
        slot = (slot + 1u) % CACHE_SLOTS;
    }
    return CACHE_EMPTY;
}

#endif
