// The faces of a bake for a camera that turns in place (twin: techniques::daylight::cube).
#ifndef LIB_DAY_CUBE
#define LIB_DAY_CUBE

// What the texels of a bake are: pixels of one view, of a lightmap, or of the faces of a cube.
const uint DAY_VIEW = 0u;      // export
const uint DAY_LIGHTMAP = 1u;  // export
const uint DAY_CUBE = 2u;      // export

// The surface that a texel of a face shows.
struct CubeTexel {
    float depth;   // along the axis of the face, metres; 0: none
    uint normal;   // octahedral, two signed numbers of 16 bits
};

vec3 day_cube_forward(uint face) {
    float side = (face & 1u) == 0u ? 1.0 : -1.0;
    return face < 2u ? vec3(side, 0.0, 0.0) : face < 4u ? vec3(0.0, side, 0.0) : vec3(0.0, 0.0, side);
}

vec3 day_cube_right(uint face) {
    if (face == 0u) return vec3(0.0, 0.0, 1.0);
    if (face == 1u) return vec3(0.0, 0.0, -1.0);
    return vec3(face == 4u ? -1.0 : 1.0, 0.0, 0.0);
}

vec3 day_cube_down(uint face) {
    if (face == 2u) return vec3(0.0, 0.0, -1.0);
    if (face == 3u) return vec3(0.0, 0.0, 1.0);
    return vec3(0.0, -1.0, 0.0);
}

// The direction through a place on a face (0 to 1, to the right and downwards); its part along the axis of the face is 1.
vec3 day_cube_direction(uint face, vec2 place) {
    vec2 p = 2.0 * place - 1.0;
    return day_cube_forward(face) + p.x * day_cube_right(face) + p.y * day_cube_down(face);
}

// The face in a direction of any length, and the place on it.
uint day_cube_face(vec3 direction, out vec2 place) {
    vec3 size = abs(direction);
    uint axis = size.x >= size.y && size.x >= size.z ? 0u : size.y >= size.z ? 1u : 2u;
    uint face = 2u * axis + (direction[axis] < 0.0 ? 1u : 0u);
    place = 0.5 + 0.5 * vec2(dot(direction, day_cube_right(face)), dot(direction, day_cube_down(face))) / size[axis];
    return face;
}

// Column, row and face of a texel that may be one step beyond the border of `face`, where the next face begins. False: three faces meet there, so
// that there is no such texel.
bool day_cube_texel(uint face, ivec2 texel, uint side, out uvec3 found) {
    bvec2 out_of = bvec2(texel.x < 0 || texel.x >= int(side), texel.y < 0 || texel.y >= int(side));
    found = uvec3(clamp(texel, ivec2(0), ivec2(side) - 1), face);
    if (out_of.x && out_of.y) return false;
    if (!out_of.x && !out_of.y) return true;
    // A quarter of a texel beyond the border: the row along the border stays the same.
    vec2 place = (vec2(texel) + 0.5) / float(side);
    float beyond = 0.25 / float(side);
    place = clamp(place, vec2(-beyond), vec2(1.0 + beyond));
    vec2 there;
    found.z = day_cube_face(day_cube_direction(face, place), there);
    found.xy = min(uvec2(there * float(side)), uvec2(side - 1u));
    return true;
}

#endif
