// The triangles of the scene with the light at their vertices.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/scene.glsl"
#include "prt/prt.glsl"

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1, scalar) readonly buffer Instances { Instance instances[]; };
layout(binding = 2, scalar) readonly buffer Drawn { uint drawn[]; };
layout(binding = 3, scalar) readonly buffer Positions { vec3 positions[]; };
layout(binding = 4, scalar) readonly buffer Meshes { PrtMesh meshes[]; };
layout(binding = 5, scalar) readonly buffer Values { vec4 values[]; };

layout(location = 0) out vec3 seen;  // position in view space, metres
layout(location = 1) out vec4 front_light;
layout(location = 2) out vec4 front_seen;
layout(location = 3) out vec4 back_light;
layout(location = 4) out vec4 back_seen;
layout(location = 5) flat out uint flipped;

void main() {
    uint i = drawn[gl_InstanceIndex];
    uint vertex = uint(gl_VertexIndex);
    vec4 world = instances[i].world_from_object * vec4(positions[instances[i].first_vertex + vertex], 1.0);
    gl_Position = view.clip_from_world * world;
    seen = (view.view_from_world * world).xyz;
    PrtMesh mesh = meshes[i];
    uint at = 2u * (mesh.first + vertex * mesh.sides);
    uint back = at + 2u * (mesh.sides - 1u);
    front_light = values[at];
    front_seen = values[at + 1u];
    back_light = values[back];
    back_seen = values[back + 1u];
    flipped = instances[i].flags & INSTANCE_FLIPPED;
}
