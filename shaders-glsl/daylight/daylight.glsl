// Paths of baked daylight: their vertices and the light that left the scene, shared by all times of the day.
// Before including: lib/sampling.glsl.
#ifndef LIB_DAYLIGHT
#define LIB_DAYLIGHT

// Vertices of a path at most, and so the scatterings before the light reaches a receiver.
const uint DAY_VERTICES = 16u; // export
// The 145 patches of the sky (Tregenza 1987), and one for all directions below the horizon.
const uint SKY_PATCHES = 146u; // export

const uint DAY_DIFFUSE_ONLY = 1u; // export
// Receivers have the detail of normal maps. Texels of lightmaps are larger than that detail.
const uint DAY_NORMAL_MAPS = 2u; // export
// Sun masks say from where the sun is seen, instead of a shadow ray from each vertex.
const uint DAY_SUN_MASKS = 4u; // export

struct DaySettings {
    uint receivers;
    uint first_receiver;  // number of the first receiver in the whole bake: its random numbers do not depend on tiles
    uint samples;         // paths of each receiver in this batch
    uint first_sample;
    uint bounces;         // vertices at most
    uint roulette;        // vertices before Russian roulette begins
    uint sharp;           // mirrors and glass surfaces along a path at most
    uint flags;           // DAY_
    uint seed;
    uint times;           // positions of the sun
    uint lights;          // of the scene
    uint groups;          // of lamps
    float sun_radius;     // tangent of the angular radius of the sun's disc
    float touching;       // surfaces that are nearer to a texel of a lightmap, metres, lie on it; 0: no lightmap
    uint places;          // paths, or points of masks, of each invocation that sends rays to the sun
};

// The sun at a time of the day.
struct DaySun {
    vec3 toward;      // unit vector towards it; for a sun that is a point, its place, metres
    float intensity;  // radiant intensity of a sun that is a point, W/sr; 0: the sun is at infinity
    vec3 right;       // axes of its disc, unit
    vec3 up;
};

// A surface point of a path that reflects direct light.
struct DayVertex {
    vec3 position;   // moved off the surface
    vec3 normal;     // shading normal, unit
    vec3 geometric;  // of the triangle, unit, on the side of the normal
    vec3 weight;     // irradiance at the receiver for each W/m² of irradiance at the vertex
    float share;     // the brightest channel of the weight, relative to that of the first vertex of the path
    uint side;       // of a cell of the sun masks, if there are any (daylight/masks.glsl)
};

// The cells of a triangle: a grid of columns along the longest side and of rows to the corner opposite to it. The sun masks have a bit for each time
// for each side of a cell: twice the number of the cell, and 1 for its back. Twin: techniques::daylight::masks::Cells.
struct DayCells {
    uint first;   // number of the first cell
    uint size;    // bits 0 to 14: columns; 15 to 29: rows; 30 and 31: the corner at which the longest side begins
    float foot;   // of the height on the longest side, as a share of that side
};

// Times of a word, and of a group of invocations that add the light of the sun.
const uint DAY_TIMES = 32u; // export

// Invocations of a group that sends rays to the sun, and of one that chooses points of masks.
const uint DAY_VISIBILITY_GROUP = 64u;

// Words of a place that have a bit for each time.
uint day_words(DaySettings settings) {
    return (settings.times + DAY_TIMES - 1u) / DAY_TIMES;
}

// The masks that the paths of a batch request.
struct DayRequests {
    uvec3 point_groups;  // that choose the points
    uvec3 ray_groups;    // that send rays from the points to the sun
    uint count;          // of sides of cells
};

// The point for which a mask has its bits.
struct DayMaskPoint {
    vec3 position;  // moved off the surface
    vec3 normal;    // of the triangle, unit, on the side of the mask
    vec2 disc;      // the place on the disc of the sun
    uint salt;
    uint side;      // of the cell
};

// The end of a path that left the scene.
struct DayEscape {
    vec3 direction;  // unit
    vec3 weight;     // irradiance at the receiver for each W/(sr m²) from this direction; 0: the path did not leave
};

// The surface of a receiver: its side that receives light.
struct DaySpot {
    vec3 position;
    vec3 normal;   // of the triangle, unit
    vec3 above;    // the position, moved off the surface
    vec3 shading;  // shading normal, unit
};

// The distance of a path of a probe that leaves the scene at once, metres.
const float DAY_FAR = 1e30; // export

// The first part of a path of a probe.
struct DayStart {
    vec3 direction;  // unit
    float distance;  // to the first surface, metres; negative: the path hits the inside of a solid
};

// Number of the sky's patch in a unit direction. Rows of 30, 30, 24, 24, 18, 12 and 6 patches, 12 degrees high, and one around the zenith. The
// first patch of a row is around -z; azimuth grows towards +x. Twin: techniques::daylight::patch::patch_of.
uint sky_patch(vec3 direction) {
    float y = direction.y;
    if (!(y >= 0.0)) return SKY_PATCHES - 1u;
    if (y >= 0.99452190) return 144u;
    uint first = 0u, count = 30u;
    if (y >= 0.20791169) { first = 30u; count = 30u; }
    if (y >= 0.40673664) { first = 60u; count = 24u; }
    if (y >= 0.58778525) { first = 84u; count = 24u; }
    if (y >= 0.74314483) { first = 108u; count = 18u; }
    if (y >= 0.86602540) { first = 126u; count = 12u; }
    if (y >= 0.95105650) { first = 138u; count = 6u; }
    int column = int(floor(atan(direction.x, -direction.z) * (float(count) / 6.2831853) + 0.5));
    return first + uint((column + int(count)) % int(count));
}

#endif
