// Draws casters with alpha cutouts into one shadow map of a virtual light.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/scene.glsl"
#include "lib/material.glsl"
#include "lib/vpl.glsl"
#include "lib/sampling.glsl"
#include "igi/vpl_map.glsl"

layout(binding = 1, scalar) readonly buffer Instances { Instance instances[]; };
layout(binding = 2, scalar) readonly buffer Visible { uint visible[]; };
layout(binding = 3, scalar) readonly buffer Positions { vec3 positions[]; };
layout(binding = 4, scalar) readonly buffer Vpls { Vpl vpls[]; };
layout(binding = 6, scalar) readonly buffer Uvs { vec2 uvs[]; };
layout(binding = 7, scalar) readonly buffer Colors { vec4 colors[]; };

layout(push_constant, scalar) uniform Push {
    uint light;    // virtual light
    uint face;     // which of the light's three maps
    float nearest; // near plane, metres
    uint seed;     // seed for alpha-blended surfaces
};

layout(location = 0) out vec2 uv;
layout(location = 1) out float alpha;
layout(location = 2) flat out uint instance_out;

void main() {
    uint i = visible[gl_InstanceIndex];
    uint vertex = uint(gl_VertexIndex);
    vec3 at = positions[instances[i].first_vertex + vertex];
    vec3 world = (instances[i].world_from_object * vec4(at, 1.0)).xyz;
    gl_Position = vpl_map_clip(vpls[light], face, nearest, world);
    uint set = materials[instances[i].material].textures[0].uv_set;
    uint first = instances[i].uv_first[set];
    uv = first == NONE ? vec2(0.0) : uvs[first + vertex];
    uint first_color = instances[i].color_first;
    alpha = first_color == NONE ? 1.0 : colors[first_color + vertex].a;
    instance_out = i;
}
