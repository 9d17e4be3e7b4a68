// Draws all triangles again with their corners in the lightmap. Vertices are corners: three for each triangle of each instance.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/scene.glsl"

struct DayPlaced {
    uint first;  // number of the first corner
    uint sides;  // that a camera can see: 1 or 2
};

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1, scalar) readonly buffer Instances { Instance instances[]; };
layout(binding = 2, scalar) readonly buffer Indices { uint indices[]; };
layout(binding = 3, scalar) readonly buffer Positions { vec3 positions[]; };
layout(binding = 4, scalar) readonly buffer Corners { uint corners[]; };    // in sixteenths of a texel, two of 16 bits
layout(binding = 5, scalar) readonly buffer Placed { DayPlaced placed[]; }; // instances

// Two numbers of a place that is none.
const uint NOWHERE = 0xffffffffu;

layout(push_constant, scalar) uniform Push {
    uint backs;  // number of the first corner of a back; 0: backs have the texels of their fronts; NOWHERE: backs have none
};

layout(location = 0) out vec3 seen;  // position in view space, metres
layout(location = 1) out vec2 front; // texels
layout(location = 2) out vec2 back;
layout(location = 3) flat out uint flipped;
layout(location = 4) flat out uint sides;
layout(location = 5) flat out uint has_back; // 0: the back has no texels

vec2 place(uint at) {
    return vec2(at & 0xffffu, at >> 16u) / 16.0;
}

void main() {
    uint i = uint(gl_InstanceIndex);
    uint corner = uint(gl_VertexIndex);
    uint vertex = indices[instances[i].first_index + corner - placed[i].first];
    vec4 world = instances[i].world_from_object * vec4(positions[instances[i].first_vertex + vertex], 1.0);
    gl_Position = view.clip_from_world * world;
    seen = (view.view_from_world * world).xyz;
    uint of_back = backs == NOWHERE ? NOWHERE : corners[corner + backs];
    front = place(corners[corner]);
    back = place(of_back);
    flipped = instances[i].flags & INSTANCE_FLIPPED;
    sides = placed[i].sides;
    has_back = of_back == NOWHERE ? 0u : 1u;
}
