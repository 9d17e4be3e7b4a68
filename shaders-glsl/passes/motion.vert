// Draws the surfaces that moved since the last frame, and computes their positions in the last frame. Skips instances that did not move.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/scene.glsl"

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1, scalar) readonly buffer Instances { Instance instances[]; };
layout(binding = 2, scalar) readonly buffer Visible { uint visible[]; };
layout(binding = 3, scalar) readonly buffer Positions { vec3 positions[]; };
layout(binding = 4, scalar) readonly buffer BeforeInstances { Instance before_instances[]; };
layout(binding = 5, scalar) readonly buffer BeforePositions { vec3 before_positions[]; }; // of the deformed vertices

layout(push_constant, scalar) uniform Push {
    uint first_deformed; // from this vertex on, the streams are rewritten in each frame
};

layout(location = 0) out vec3 before;
layout(location = 1) out vec3 seen; // position in view space, metres

void main() {
    uint i = visible[gl_InstanceIndex];
    uint at = instances[i].first_vertex + uint(gl_VertexIndex);
    mat4 now = instances[i].world_from_object;
    mat4 then = before_instances[i].world_from_object;
    bool deformed = instances[i].first_vertex >= first_deformed;
    vec4 world = now * vec4(positions[at], 1.0);
    vec3 was = deformed ? before_positions[at - first_deformed] : positions[at];
    before = (then * vec4(was, 1.0)).xyz;
    seen = (view.view_from_world * world).xyz;
    // A resting instance is moved outside of the clip volume, so that it is not drawn.
    gl_Position = deformed || now != then ? view.clip_from_world * world : vec4(0.0, 0.0, 2.0, 1.0);
}
