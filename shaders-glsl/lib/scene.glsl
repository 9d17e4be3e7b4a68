// Geometry of the resident scene: what vertex pulling reads. The streams hold every primitive once, and once more for
// each instance that is skinned or morphed (written each frame by scene/deform.comp).
#ifndef LIB_SCENE
#define LIB_SCENE

const uint NONE = 0xffffffffu;

const uint INSTANCE_FLIPPED = 1u; // export

struct Instance {
    mat4 world_from_object;
    mat3 normal_from_object; // cofactors: right for every scale, length not kept
    uint first_vertex;       // into positions, normals, tangents
    uint uv_first[4];        // into uvs, for each set; NONE: the primitive has no such set
    uint color_first;        // into colors, or NONE
    uint material;
    uint flags;              // INSTANCE_FLIPPED: the transform mirrors, so triangles wind clockwise
    uint first_index;        // into indices
    uint index_count;
};

#endif
