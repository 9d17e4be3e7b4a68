// Addresses of the resident scene and of its trees (lucerna::rays). CPU drivers gather what lies at addresses for all their lanes at once. From
// bound buffers they load for one lane after the other, with a check of bounds for each number. The buffers are bound as well, so that graphs
// know who reads them.
#ifndef LIB_SCENE_AT
#define LIB_SCENE_AT
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require
#include "lib/scene.glsl"
#include "lib/material.glsl"

struct SceneAddresses {
    uvec2 nodes;      // of the trees
    uvec2 triangles;
    uvec2 instances;
    uvec2 indices;
    uvec2 positions;
    uvec2 normals;
    uvec2 tangents;
    uvec2 uvs;
    uvec2 colors;
    uvec2 materials;
};

layout(binding = 48, scalar) uniform SceneAt { SceneAddresses scene_at; };

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer WordsAt { uint of[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer VectorsOf2At { vec2 of[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer VectorsOf3At { vec3 of[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer VectorsOf4At { vec4 of[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer InstancesAt { Instance of[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer MaterialsAt { Material of[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer TraceNodesAt { uvec4 of[]; };

#define INSTANCE_AT(i) InstancesAt(scene_at.instances).of[i]
#define INDEX_AT(i) WordsAt(scene_at.indices).of[i]
#define POSITION_AT(i) VectorsOf3At(scene_at.positions).of[i]
#define NORMAL_AT(i) VectorsOf3At(scene_at.normals).of[i]
#define TANGENT_AT(i) VectorsOf4At(scene_at.tangents).of[i]
#define UV_AT(i) VectorsOf2At(scene_at.uvs).of[i]
#define COLOR_AT(i) VectorsOf4At(scene_at.colors).of[i]
#define MATERIAL_AT(i) MaterialsAt(scene_at.materials).of[i]

#endif
