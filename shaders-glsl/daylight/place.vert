// Draws all triangles again with their corners in the lightmap. Vertices are corners: three for each triangle of each instance.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/scene.glsl"

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1, scalar) readonly buffer Instances { Instance instances[]; };
layout(binding = 2, scalar) readonly buffer Indices { uint indices[]; };
layout(binding = 3, scalar) readonly buffer Positions { vec3 positions[]; };
layout(binding = 4, scalar) readonly buffer Corners { uint corners[]; };    // in sixteenths of a texel, two of 16 bits
layout(binding = 5, scalar) readonly buffer Firsts { uint firsts[]; };      // number of the first corner of each instance

layout(location = 0) out vec3 seen;  // position in view space, metres
layout(location = 1) out vec2 place; // texels

void main() {
    uint i = uint(gl_InstanceIndex);
    uint corner = uint(gl_VertexIndex);
    uint vertex = indices[instances[i].first_index + corner - firsts[i]];
    vec4 world = instances[i].world_from_object * vec4(positions[instances[i].first_vertex + vertex], 1.0);
    gl_Position = view.clip_from_world * world;
    seen = (view.view_from_world * world).xyz;
    place = vec2(corners[corner] & 0xffffu, corners[corner] >> 16u) / 16.0;
}
