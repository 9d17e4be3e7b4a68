// Fullsphere irradiance vectors (Michael 2010, chapter 3): types and constants of the cube map, the occluders and their
// vectors.
#ifndef LIB_FIV
#define LIB_FIV

// A texel of the environment.
struct FivTexel {
    vec3 radiance; // W/(sr·m²)
    float angle;   // solid angle, sr
    vec3 area;     // integral of the direction over the texel, sr
};

// An occluder in its current pose, with the location of its vectors.
struct FivOccluder {
    vec3 centre;    // of its bounding sphere, metres, world space
    float radius;   // of its bounding sphere, metres
    float fill;     // mean share of the bounding disc that it fills, for the overlap correction
    float cut_fill; // the same share for the correction of partial occluders
    uint first;     // float of its first vector
    uint second;    // float of its first vector at the next rotation sample
    float blend;    // fraction of the way to the next rotation sample
    uint azimuths;  // samples around +Y
    uint polars;    // samples from +Y to -Y, both included
    uint radii;     // spheres
    float nearest;  // radius of the first sphere, metres
    float farthest; // radius of the last sphere, metres
    float steps;    // spheres for each factor of e of the radius
    uint spacing;   // float of its table: FIV_SPACING_KNOTS sample numbers at even steps of each coordinate, then the spheres' radii
    uint reach;     // float of its support function (fiv/reach.glsl), or FIV_NONE for its bounding sphere
    uint turned;    // 1: its pose differs from the pose of the support function
    uint self_shadows; // 1: its vectors fit its current pose, so it shadows itself with them
    mat3 to_rest;   // takes directions to the pose at rest: the transpose of its rotation and scale
};

// A point that looks at an occluder.
struct FivPoint {
    vec3 at;   // relative to the centre of the occluder, metres, world axes
    uint turn; // number of its pose in the list of FivTurn
};

// Pose of an occluder relative to the geometry that rays are traced through.
struct FivTurn {
    mat3 geometry_from_world;
    vec3 centre;  // centre of the occluder in the geometry, metres
    float radius; // radius of its bounding sphere, metres, world axes
};

// A bright part of the environment.
struct FivSpot {
    vec3 direction; // unit
    float radius;   // sine of the half angle of a cap of its solid angle
    vec3 x;         // fullsphere irradiance vectors of its light, W/m²
    vec3 y;
    vec3 z;
};

// Links the surface of an instance to its occluder.
struct FivOwner {
    uint occluder; // number of the occluder, or FIV_NONE
    uint front;    // float of the vector of the first vertex's front side, or FIV_NONE
    uint back;     // the same for the back side
    uint front_next; // both at the next rotation sample
    uint back_next;
    float blend;     // fraction of the way to the next rotation sample
    uint flipped;  // 1: the transform mirrors the surface
};

// A texel that is separated from the vectors.
struct FivSun {
    vec3 radiance;  // W/(sr·m²)
    vec3 area;      // integral of the direction over the texel, sr
    vec3 direction; // unit vector to its middle
    vec3 right;     // axes of its shadow maps
    vec3 up;
};

// The shadow maps of an occluder.
struct FivShade {
    uint map; // float of the map of the first separated texel
    uint own; // 1: the maps fit its current pose, so it shadows itself with them
};

// Texels along an edge of a shadow map, which covers the bounding sphere.
const uint FIV_SUN_SIDE = 192u; // export
// Depth of texels that the occluder does not cover, metres.
const float FIV_SUN_FREE = -1e30;

const uint FIV_SPACING_KNOTS = 33u; // export
const uint FIV_NONE = 0xffffffffu;
// Directions of a support function.
const uint FIV_REACH_AZIMUTHS = 32u; // export
const uint FIV_REACH_POLARS = 17u; // export

const uint FIV_FLOATS = 9u; // export
// Value of the first float of a vector whose sample lies inside the occluder.
const float FIV_INSIDE = 1e38; // export

// Most bright parts of the environment.
const uint FIV_SPOTS = 4u; // export
// Directions and sizes of the table of greatest radiance (fiv/matter.glsl).
const uint FIV_MATTER_AZIMUTHS = 64u; // export
const uint FIV_MATTER_POLARS = 33u; // export
const uint FIV_MATTER_LEVELS = 6u; // export

const float FIV_PI = 3.14159265358979;

// Direction (not normalised) of a point of a face, `st` in 0..1 from its top left corner. Faces are those of
// scene::environment::Face.
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

// Direction for a samplerCube with these faces, whose space is left-handed.
vec3 cube_lookup(vec3 direction) {
    return vec3(direction.xy, -direction.z);
}

#endif
