// Fullsphere irradiance vectors (Michael 2010, chapter 3): cubes of light, stored vectors and how they are looked up.
#ifndef LIB_FIV
#define LIB_FIV

// A texel of the environment.
struct FivTexel {
    vec3 radiance; // W/(sr·m²)
    float angle;   // solid angle, sr
    vec3 area;     // integral of the direction over the texel, sr
};

// An occluder that stands somewhere, with the place of its vectors.
struct FivOccluder {
    vec3 centre;    // of its bounding sphere, metres, world space
    float radius;   // of its bounding sphere, metres
    float fill;     // share of the bounding disc that it hides, on average, as the correction for overlaps takes it
    float cut_fill;    // the same, as the correction for partial occluders takes it
    uint first;     // float of its first vector
    uint second;    // the same of the next turn
    float blend;    // part of the way to the next turn
    uint azimuths;  // samples around +Y
    uint polars;    // samples from +Y to -Y, both included
    uint radii;     // spheres
    float nearest;  // radius of the first sphere, metres
    float farthest; // radius of the last sphere, metres
    float steps;    // spheres for each factor of e of the radius
    uint spacing;      // float of FIV_SPACING_KNOTS numbers of samples at even steps of each coordinate, then the spheres' radii
    uint reach;     // float of its table of how far it reaches (lib/fiv_reach.glsl), or FIV_NONE: as its bounding sphere
    uint turned;    // 1: it does not stand as that table has it
    uint self_shadows;   // 1: it stands as its vectors have it, and shadows itself by them
    mat3 to_rest;   // takes directions to it at rest: the transpose of what turned and scaled it
};

// A place from which an occluder is looked at.
struct FivPoint {
    vec3 at;   // seen from the centre of the occluder, metres, world axes
    uint turn; // number of its FivTurn
};

// How an occluder stands against the geometry that rays are traced through.
struct FivTurn {
    mat3 geometry_from_world;
    vec3 centre;  // of the occluder in the geometry, metres
    float radius; // of its bounding sphere, metres, world axes
};

// A bright part of the environment.
struct FivSpot {
    vec3 direction; // unit
    float radius;   // sine of the half angle of a cap of its solid angle
    vec3 x;         // its light as a vector a channel, W/m²
    vec3 y;
    vec3 z;
};

// What the surface of an instance needs to know of the occluder that it is of.
struct FivOwner {
    uint occluder; // FIV_NONE: of none
    uint front;    // float of the vector of the front of the first corner, or FIV_NONE
    uint back;     // as well for its back
    uint front_next; // both for the next turn
    uint back_next;
    float blend;     // part of the way to the next turn
    uint flipped;  // 1: the transform mirrors
};

// A texel of the environment that is kept apart.
struct FivSun {
    vec3 radiance;  // W/(sr·m²)
    vec3 area;      // integral of the direction over the texel, sr
    vec3 direction; // of its middle
    vec3 right;     // axes of the maps of what hides it
    vec3 up;
};

// An occluder and its maps.
struct FivShade {
    uint map; // float of the first sun's
    uint own; // 1: it stands as the maps have it, and shadows itself
};

// Texels along an edge of a map, which is as wide as the occluder's bounding sphere.
const uint FIV_SUN_SIDE = 192u; // export
// Stands where there is nothing of the occluder, metres.
const float FIV_SUN_FREE = -1e30;

const uint FIV_SPACING_KNOTS = 33u; // export
const uint FIV_NONE = 0xffffffffu;
// Directions for which it is known how far an occluder reaches.
const uint FIV_REACH_AZIMUTHS = 32u; // export
const uint FIV_REACH_POLARS = 17u; // export

const uint FIV_FLOATS = 9u; // export
// Stands in the first float of a vector whose sample lies inside the occluder.
const float FIV_INSIDE = 1e38; // export

// Bright parts of the environment at most.
const uint FIV_SPOTS = 4u; // export
// Directions and sizes for which it is known how bright the environment is at most (lib/fiv_matter.glsl).
const uint FIV_MATTER_AZIMUTHS = 64u; // export
const uint FIV_MATTER_POLARS = 33u; // export
const uint FIV_MATTER_LEVELS = 6u; // export

const float FIV_PI = 3.14159265358979;

// Direction (not normalised) of a point of a face, `st` in 0..1 from its top left corner; faces as scene::environment::Face.
vec3 cube_direction(uint face, vec2 st) {
    vec2 p = 2.0 * st - 1.0;
    switch (face) {
    case 0u: return vec3(1.0, -p.y, p.x);
    case 1u: return vec3(-1.0, -p.y, -p.x);
    case 2u: return vec3(p.x, 1.0, -p.y);
    case 3u: return vec3(p.x, -1.0, p.y);
    case 4u: return vec3(p.x, -p.y, -1.0);
    default: return vec3(-p.x, -p.y, 1.0);
    }
}

// The direction by which a samplerCube has these faces: theirs is a left-handed space.
vec3 cube_lookup(vec3 direction) {
    return vec3(direction.xy, -direction.z);
}

#endif
