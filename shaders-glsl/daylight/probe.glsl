// Probes: irradiance at points in space for all normals, as spherical harmonics of bands 0 to 2 (Ramamoorthi and Hanrahan, An Efficient
// Representation for Irradiance Environment Maps, 2001). Twin: techniques::daylight::probes.
#ifndef LIB_DAY_PROBE
#define LIB_DAY_PROBE

// Spherical harmonics of bands 0 to 2.
const uint PROBE_TERMS = 9u; // export
// Directions in which a bake holds the irradiance of a probe: the corners of an icosahedron. Sums over them are exact integrals of the product
// of two such functions, so an error at these directions is the error over all directions.
const uint PROBE_DIRECTIONS = 12u; // export
// Texels along a side of the octahedral map of distances around a probe.
const uint PROBE_SIDE = 8u; // export
// Probes along a side of a brick, which has its own images.
const uint PROBE_BRICK = 4u; // export

struct DayGrid {
    vec3 origin;   // of the first probe, world space, metres
    vec3 spacing;  // metres
    uvec3 counts;
    float most;    // distances in the maps end here, metres
};

struct DayProbe {
    vec3 position;  // world space, metres; moved out of solids
    uint near;      // the probe that stands in for this one: itself, or the nearest one if this one is inside a solid; NONE: there is none
};

const float ICO_SHORT = 0.52573111; // 1 / sqrt(1 + φ²), φ the golden ratio
const float ICO_LONG = 0.85065081;  // φ / sqrt(1 + φ²)

vec3 probe_direction(uint i) {
    vec2 pair = vec2((i & 1u) != 0u ? -ICO_SHORT : ICO_SHORT, (i & 2u) != 0u ? -ICO_LONG : ICO_LONG);
    uint turn = i / 4u;
    if (turn == 0u) return vec3(0.0, pair);
    return turn == 1u ? vec3(pair.y, 0.0, pair.x) : vec3(pair, 0.0);
}

// The harmonics in a unit direction.
float[PROBE_TERMS] probe_harmonics(vec3 d) {
    return float[PROBE_TERMS](0.28209479, 0.48860251 * d.y, 0.48860251 * d.z, 0.48860251 * d.x, 1.09254843 * d.x * d.y, 1.09254843 * d.y * d.z,
        0.31539157 * (3.0 * d.z * d.z - 1.0), 1.09254843 * d.x * d.z, 0.54627422 * (d.x * d.x - d.y * d.y));
}

// The brick of a probe, and the number of the probe in it.
uvec2 probe_brick(DayGrid grid, uvec3 at) {
    uvec3 bricks = (grid.counts + PROBE_BRICK - 1u) / PROBE_BRICK;
    uvec3 brick = at / PROBE_BRICK;
    uvec3 inside = at - brick * PROBE_BRICK;
    uvec3 size = min(uvec3(PROBE_BRICK), grid.counts - brick * PROBE_BRICK);
    return uvec2((brick.z * bricks.y + brick.y) * bricks.x + brick.x, (inside.z * size.y + inside.y) * size.x + inside.x);
}

uint probe_number(DayGrid grid, uvec3 at) {
    return (at.z * grid.counts.y + at.y) * grid.counts.x + at.x;
}

#endif
