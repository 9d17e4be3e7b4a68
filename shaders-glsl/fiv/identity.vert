// Vertices of the pass that draws the visible occluder of each pixel and the light past that occluder.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/scene.glsl"
#include "fiv/fiv.glsl"

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1, scalar) readonly buffer Instances { Instance instances[]; };
layout(binding = 2, scalar) readonly buffer Visible { uint visible[]; };
layout(binding = 3, scalar) readonly buffer Positions { vec3 positions[]; };
layout(binding = 4, scalar) readonly buffer Owners { FivOwner owners[]; }; // of each instance
layout(binding = 5, scalar) readonly buffer Fivs { float fivs[]; };

layout(location = 0) out vec3 seen; // position in view space, metres
layout(location = 1) flat out uint instance;
// Vectors of the light that reaches the front and the back of surfaces. w of x: 1, or 0 where the vectors are not
// known.
layout(location = 2) out vec4 front_x;
layout(location = 3) out vec3 front_y;
layout(location = 4) out vec3 front_z;
layout(location = 5) out vec4 back_x;
layout(location = 6) out vec3 back_y;
layout(location = 7) out vec3 back_z;

void load(uint first, out vec4 x, out vec3 y, out vec3 z) {
    x = vec4(0.0);
    y = vec3(0.0);
    z = vec3(0.0);
    uint at = first + FIV_FLOATS * uint(gl_VertexIndex);
    if (first == FIV_NONE || fivs[at] >= FIV_INSIDE) return;
    x = vec4(fivs[at], fivs[at + 1u], fivs[at + 2u], 1.0);
    y = vec3(fivs[at + 3u], fivs[at + 4u], fivs[at + 5u]);
    z = vec3(fivs[at + 6u], fivs[at + 7u], fivs[at + 8u]);
}

// Interpolates between two rotation samples.
void load(uint first, uint next, float blend, out vec4 x, out vec3 y, out vec3 z) {
    load(first, x, y, z);
    if (blend <= 0.0) return;
    vec4 next_x;
    vec3 next_y, next_z;
    load(next, next_x, next_y, next_z);
    x = mix(x, next_x, blend);
    y = mix(y, next_y, blend);
    z = mix(z, next_z, blend);
}

void main() {
    uint i = visible[gl_InstanceIndex];
    vec4 world = instances[i].world_from_object * vec4(positions[instances[i].first_vertex + uint(gl_VertexIndex)], 1.0);
    gl_Position = view.clip_from_world * world;
    seen = (view.view_from_world * world).xyz;
    instance = i;
    FivOwner owner = owners[i];
    load(owner.front, owner.front_next, owner.blend, front_x, front_y, front_z);
    load(owner.back, owner.back_next, owner.blend, back_x, back_y, back_z);
}
