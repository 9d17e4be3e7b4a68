// Orthographic depth images of an occluder along the directions of rays of the environment's cube map: how far the
// occluder extends to the back on each line.
#ifndef LIB_FIV_PARALLEL
#define LIB_FIV_PARALLEL

const uint FIV_PARALLEL_SIDE = 128u; // export
// Steps of the depth over the occluder's bounding sphere. 0 marks a line that misses the occluder.
const float FIV_PARALLEL_STEPS = 65534.0;

// Coordinates of `v` relative to a face of the cube: two in its plane, then out of the plane.
vec3 parallel_coordinates(uint face, vec3 v) {
    float s = (face & 1u) == 0u ? 1.0 : -1.0;
    if (face == 4u || face == 5u) s = -s;
    return face < 2u ? vec3(v.yz, s * v.x) : face < 4u ? vec3(v.xz, s * v.y) : vec3(v.xy, s * v.z);
}

// The inverse of parallel_coordinates.
vec3 parallel_direction(uint face, vec3 c) {
    float s = (face & 1u) == 0u ? 1.0 : -1.0;
    if (face == 4u || face == 5u) s = -s;
    return face < 2u ? vec3(s * c.z, c.xy) : face < 4u ? vec3(c.x, s * c.z, c.y) : vec3(c.xy, s * c.z);
}

// Extent of the unit sphere in the plane of a face for a projection along `along` (coordinates with a third of 1).
vec2 parallel_reach(vec3 along) {
    return sqrt(1.0 + along.xy * along.xy);
}

#endif
