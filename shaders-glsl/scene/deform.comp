// Morphs, then skins the vertices of one primitive of one node into its own range of the streams
// (glTF 2.0, 3.7.2.2 and 3.7.3). CPU twin: scene::deform::world_vertices.
#version 460
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

struct SkinVertex {
    uvec2 joints; // four 16-bit numbers
    vec4 weights;
};

struct MorphDelta {
    vec3 position;
    vec3 normal;
    vec3 tangent;
};

layout(binding = 0, scalar) buffer Positions { vec3 positions[]; };
layout(binding = 1, scalar) buffer Normals { vec3 normals[]; };
layout(binding = 2, scalar) buffer Tangents { vec4 tangents[]; };
layout(binding = 3, scalar) readonly buffer SkinVertices { SkinVertex skin_vertices[]; };
layout(binding = 4, scalar) readonly buffer MorphDeltas { MorphDelta morph_deltas[]; };
layout(binding = 5, scalar) readonly buffer Joints { mat4 joints[]; };
layout(binding = 6, scalar) readonly buffer Weights { float weights[]; };
layout(push_constant, scalar) uniform Push {
    uint source;        // first vertex at rest
    uint target;        // first vertex to write
    uint count;         // vertices
    uint joint_sets;    // 0: not skinned
    uint skin_first;    // into skin_vertices; set s of vertex v at skin_first + s * count + v
    uint joint_first;   // into joints
    uint joint_count;
    uint morph_targets;
    uint morph_first;   // into morph_deltas; target t of vertex v at morph_first + t * count + v
    uint weight_first;  // into weights
};

// Transforms normals under every scale; the sign keeps them outside of mirrored meshes.
mat3 cofactor(mat3 m) {
    mat3 c = mat3(cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1]));
    return dot(m[0], c[0]) < 0.0 ? -c : c;
}

vec3 unit(vec3 v) {
    float len = length(v);
    return len > 0.0 ? v / len : vec3(0.0);
}

void main() {
    uint v = gl_GlobalInvocationID.x;
    if (v >= count) return;
    vec3 position = positions[source + v];
    vec3 normal = normals[source + v];
    vec4 tangent = tangents[source + v];
    for (uint t = 0u; t < morph_targets; ++t) {
        float w = weights[weight_first + t];
        if (w == 0.0) continue;
        MorphDelta delta = morph_deltas[morph_first + t * count + v];
        position += w * delta.position;
        normal += w * delta.normal;
        tangent.xyz += w * delta.tangent;
    }
    if (joint_sets > 0u) {
        mat4 world = mat4(0.0);
        for (uint s = 0u; s < joint_sets; ++s) {
            SkinVertex influence = skin_vertices[skin_first + s * count + v];
            for (uint k = 0u; k < 4u; ++k) {
                uint joint = (influence.joints[k >> 1u] >> (16u * (k & 1u))) & 0xffffu;
                if (joint < joint_count) world += influence.weights[k] * joints[joint_first + joint];
            }
        }
        mat3 linear = mat3(world);
        position = (world * vec4(position, 1.0)).xyz;
        normal = cofactor(linear) * normal;
        tangent.xyz = linear * tangent.xyz;
    }
    positions[target + v] = position;
    normals[target + v] = unit(normal);
    tangents[target + v] = vec4(unit(tangent.xyz), tangent.w);
}
