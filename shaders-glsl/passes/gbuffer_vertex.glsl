// Vertex stage of passes/gbuffer and passes/gbuffer_behind, and with EYES of passes/gbuffer_eyes.
#include "lib/view.glsl"
#include "lib/scene.glsl"

#include "passes/gbuffer_view.glsl"
layout(binding = 1, scalar) readonly buffer Instances { Instance instances[]; };
layout(binding = 2, scalar) readonly buffer Visible { uint visible[]; };
layout(binding = 3, scalar) readonly buffer Positions { vec3 positions[]; };
layout(binding = 4, scalar) readonly buffer Normals { vec3 normals[]; };
layout(binding = 5, scalar) readonly buffer Tangents { vec4 tangents[]; };
layout(binding = 6, scalar) readonly buffer Uvs { vec2 uvs[]; };
layout(binding = 7, scalar) readonly buffer Colors { vec4 colors[]; };

layout(location = 0) out vec3 normal_out;
layout(location = 1) out vec4 tangent_out;
layout(location = 2) out vec4 uv01;
layout(location = 3) out vec4 uv23;
layout(location = 4) out vec4 color_out;
layout(location = 5) out vec3 seen; // position in view space, metres
layout(location = 6) flat out uint instance_out;

vec2 uv_set(uint i, uint set, uint vertex) {
    uint first = instances[i].uv_first[set];
    return first == NONE ? vec2(0.0) : uvs[first + vertex];
}

void main() {
    uint i = visible[gl_InstanceIndex];
    uint vertex = uint(gl_VertexIndex);
    uint at = instances[i].first_vertex + vertex;
    mat4 world_from_object = instances[i].world_from_object;
    vec4 world = world_from_object * vec4(positions[at], 1.0);
    gl_Position = view.clip_from_world * world;
    seen = (view.view_from_world * world).xyz;
    normal_out = instances[i].normal_from_object * normals[at];
    vec4 tangent = tangents[at];
    // A mirroring transform turns the bitangent around.
    float side = (instances[i].flags & INSTANCE_FLIPPED) != 0u ? -1.0 : 1.0;
    tangent_out = vec4(mat3(world_from_object) * tangent.xyz, tangent.w * side);
    uv01 = vec4(uv_set(i, 0u, vertex), uv_set(i, 1u, vertex));
    uv23 = vec4(uv_set(i, 2u, vertex), uv_set(i, 3u, vertex));
    uint first_color = instances[i].color_first;
    color_out = first_color == NONE ? vec4(1.0) : colors[first_color + vertex];
    instance_out = i;
}
