// The surfaces that a camera sees at the centres of its pixels: the receivers of a bake for one view.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/scene.glsl"
#include "lib/random.glsl"
#include "lib/material.glsl"
#define SURFACE_BINDING 3
#include "lib/hit_surface.glsl"
#include "lib/trace.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1, scalar) readonly buffer Pixels { uvec2 pixels[]; };
layout(binding = 2, scalar) writeonly buffer Receivers { Hit receivers[]; };

layout(push_constant, scalar) uniform Push {
    uint count;
    uvec2 extent;
};

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    vec2 uv = (vec2(pixels[i]) + 0.5) / vec2(extent);
    // From the near plane to the far plane, like the rasteriser.
    float near = view.near / view.far;
    vec3 direction = view_ray(view, uv);
    Hit hit = trace(Ray(view_base(view, uv) + near * direction, 0.0, direction, 1.0 - near), TRACE_CAMERA | TRACE_SOLID, 0u, false);
    if (hit.instance != NONE) {
        vec3 area = surface_point(hit.instance, hit.triangle, hit.barycentrics).area;
        hit.t = dot(area, direction) <= 0.0 ? 1.0 : -1.0;
    }
    receivers[i] = hit;
}
