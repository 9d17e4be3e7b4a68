// Albedos of samples by the present materials: of the diffuse base, and with GLOSS all reflected energy.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/scene.glsl"
#include "lib/material.glsl"
#include "lib/brdf.glsl"
#include "prt/prt.glsl"
#define SURFACE_BINDING 1
// The instances of a frame have no address, so all are read from bound buffers.
#define LIB_SCENE_AT
#define INSTANCE_AT(i) surface_instances[i]
#define INDEX_AT(i) surface_indices[i]
#define POSITION_AT(i) surface_positions[i]
#define NORMAL_AT(i) surface_normals[i]
#define TANGENT_AT(i) surface_tangents[i]
#define UV_AT(i) surface_uvs[i]
#define COLOR_AT(i) surface_colors[i]
#include "lib/hit_surface.glsl"
#include "prt/reflectance.glsl"

layout(local_size_x = 64) in;

layout(constant_id = 0) const uint GLOSS = 1u;

layout(binding = 8, scalar) readonly buffer Samples { PrtPoint samples[]; };
layout(binding = 9, scalar) writeonly buffer Albedos { vec3 albedos[]; };

layout(push_constant, scalar) uniform Push { uint count; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    PrtPoint s = samples[i];
    SurfacePoint point = surface_point(s.instance, s.triangle, s.barycentrics);
    albedos[i] = surface_reflectance(s.instance, point, s.material, GLOSS != 0u);
}
