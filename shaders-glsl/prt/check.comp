// Light of point lights of 1 W/sr at some samples by following paths: the truth that a bake is compared with. All surfaces are diffuse.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/scene.glsl"
#include "lib/random.glsl"
#include "lib/material.glsl"
#include "lib/brdf.glsl"
#include "lib/sampling.glsl"
#include "lib/points.glsl"
#define SURFACE_BINDING 1
#include "lib/hit_surface.glsl"
#include "lib/trace.glsl"
#include "prt/prt.glsl"
#include "prt/reflectance.glsl"

layout(local_size_x = 64) in;

layout(constant_id = 0) const uint GLOSS = 1u;

layout(binding = 8, scalar) readonly buffer Samples { PrtPoint samples[]; };
layout(binding = 9, scalar) readonly buffer Chosen { uint chosen[]; };
layout(binding = 10, scalar) readonly buffer Places { vec3 places[]; };
// Irradiance before any scattering: light after light for each chosen sample.
layout(binding = 11, scalar) writeonly buffer Direct { float direct[]; };
// Sum over the paths of the irradiance after at least one scattering: light after light for each part of the paths of each chosen sample.
layout(binding = 12, scalar) buffer Indirect { vec3 indirect[]; };

layout(push_constant, scalar) uniform Push {
    uint first;   // path of a part
    uint count;
    uint chosen_of;
    uint lights;
    uint seed;
};

// Irradiance by a light.
float irradiance_at(vec3 position, vec3 side, vec3 normal, float gap, uint light, uint salt) {
    vec3 way = places[light] - position;
    float far = length(way);
    vec3 direction = way / max(far, 1e-9);
    float cosine = dot(direction, normal);
    if (cosine <= 0.0 || dot(direction, side) <= 0.0) return 0.0;
    Ray ray = Ray(position + (side + direction) * gap, 0.0, direction, far * 0.9999);
    return trace_any(ray, TRACE_SHADOW, salt) ? 0.0 : cosine / (far * far);
}

void main() {
    uint row = gl_GlobalInvocationID.x;
    if (row >= PRT_CHECK_PARTS * chosen_of) return;
    uint number = chosen[row / PRT_CHECK_PARTS], part = row % PRT_CHECK_PARTS;
    PrtPoint s = samples[number];
    if (first == 0u && part == 0u) {
        for (uint l = 0u; l < lights; ++l) {
            direct[row / PRT_CHECK_PARTS * lights + l] = irradiance_at(s.position, s.side, s.normal, s.gap, l, 0u);
        }
    }
    for (uint i = first; i < first + count; ++i) {
        // The parts have sequences of their own, so their errors do not depend on each other.
        PointPlace place = point_place(uvec2(number & 0xffffu, number >> 16u | part << 8u), i, POINTS_APART, seed);
        vec3 throughput = vec3(1.0);
        vec3 position = s.position, side = s.side, normal = s.normal;
        float gap = s.gap;
        for (uint bounce = 0u; bounce < PRT_CHECK_BOUNCES; ++bounce) {
            vec3 direction = frame_around(normal) * sample_cosine(unit_floats(point_words(place, 2u * bounce, seed)));
            if (dot(direction, side) <= 0.0) break;
            uint salt = pcg4d(uvec4(number, PRT_CHECK_PARTS * i + part, bounce, seed)).x;
            Hit hit = trace(Ray(position + (side + direction) * gap, 0.0, direction, 1e30), TRACE_SHADOW, salt, false);
            if (hit.instance == NONE) break;
            SurfacePoint p = surface_point(hit.instance, hit.triangle, hit.barycentrics);
            position = p.position;
            side = normalize(p.area);
            normal = normalize(surface_normal(hit.instance, p));
            if (dot(side, direction) > 0.0) {
                side = -side;
                normal = -normal;
            }
            if (any(isnan(side))) break;
            if (any(isnan(normal)) || dot(normal, side) <= 0.0) normal = side;
            gap = surface_gap(p);
            throughput *= surface_reflectance(hit.instance, p, INSTANCE_AT(hit.instance).material, GLOSS != 0u);
            for (uint l = 0u; l < lights; ++l) {
                float e = irradiance_at(position, side, normal, gap, l, salt ^ l);
                if (e > 0.0) indirect[row * lights + l] += throughput * e;
            }
            float on = min(max(throughput.r, max(throughput.g, throughput.b)), 0.95);
            // The first scatterings carry most of the light, so their paths always go on.
            if (bounce >= 2u) {
                if (unit_floats(point_words(place, 2u * bounce + 1u, seed)).x >= on) break;
                throughput /= on;
            } else if (on <= 0.0) {
                break;
            }
        }
    }
}
