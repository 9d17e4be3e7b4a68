// The irradiance cache for the surfaces of ray tree nodes: a hashed grid of cells. Each cell stands for a cube of space and a direction of
// the normal, and holds the irradiance at one point (after the instant caching of Debattista et al., Instant Caching for Interactive Global
// Illumination, 2009, and the hashed cells of Binder et al., Massively Parallel Path Space Filtering, 2019).
#ifndef LIB_IGI_CACHE
#define LIB_IGI_CACHE

// Slots of the hash table: a power of two, and twice the maximum of cells.
const uint CACHE_SLOTS = 262144u; // export
// Maximum of cells. If a frame needs more, the cache is not used, and every surface gathers.
const uint CACHE_CELLS = 131072u; // export
const uint CACHE_EMPTY = 0xffffffffu;
// Maximum of slots that are searched for a key.
const uint CACHE_PROBES = 1024u;

struct CacheCell {
    vec3 position; // where the cell gathers light, metres
    float gap;     // step off the surface, metres
    vec3 normal;
    uint node;     // the lowest number of a node in the cell; independent of the order of invocations
    vec3 light;    // irradiance, W/m²
};

layout(binding = 80, scalar) buffer CacheKeys { uint cache_keys[]; };
layout(binding = 81, scalar) buffer CacheCells { CacheCell cache_cells[]; };
layout(binding = 82, scalar) buffer CacheList { uint cache_count; uint cache_list[]; }; // slots of the cells, in any order

// Class of a normal's direction, 0 to 29: for each side of a cube its middle and the four parts around it. Axis-parallel normals are far
// from the borders between classes, so that rounding does not change their class.
uint cache_facing(vec3 n) {
    vec3 size = abs(n);
    uint axis = size.x > size.y && size.x > size.z ? 0u : size.y > size.z ? 1u : 2u;
    vec3 turned = axis == 0u ? n.yzx : axis == 1u ? n.zxy : n;
    vec2 off = turned.xy / abs(turned.z);
    vec2 most = abs(off);
    uint part = max(most.x, most.y) < 0.45 ? 0u : most.x > most.y ? (off.x > 0.0 ? 1u : 2u) : (off.y > 0.0 ? 3u : 4u);
    return (2u * axis + (turned.z < 0.0 ? 1u : 0u)) * 5u + part;
}

// Nine bits for each axis: the side of a cell is at least 1/500 of the scene's diagonal.
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

// Slot of a key in the table, or CACHE_EMPTY.
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
