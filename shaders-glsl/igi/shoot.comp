// Traces one segment of every light path: from the lamp or the last surface to the next surface, where the path leaves a virtual light.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/scene.glsl"
#include "lib/random.glsl"
#include "lib/material.glsl"
#include "lib/lights.glsl"
#include "lib/sampling.glsl"
#include "lib/bsdf.glsl"
#define ENVIRONMENT_BINDING 8
#define ENVIRONMENT_EDGES_BINDING 9
#include "lib/environment_sampling.glsl"
#define SURFACE_BINDING 1
#include "lib/hit_surface.glsl"
#include "lib/trace.glsl"
#include "igi/igi.glsl"
#include "lib/vpl.glsl"
#include "igi/vpl_surface.glsl"

layout(local_size_x = 64) in;

layout(binding = 10, scalar) uniform SettingsBlock { IgiSettings settings; };
layout(binding = 11, scalar) readonly buffer Starts { VplStart starts[]; };
layout(binding = 12, scalar) readonly buffer Numbers { float numbers[]; }; // Halton table: rows of VPL_FIRST_NUMBERS + 2 bounces numbers in [0, 1)
layout(binding = 13, scalar) buffer Paths { VplPath paths[]; };
layout(binding = 14, scalar) buffer Vpls { Vpl vpls[]; }; // first the lights at the first hits of all paths, then those at the second hits, …

layout(push_constant, scalar) uniform Push {
    uint turn; // number of segments traced before
};

vec2 number_pair(uint path, uint pair) {
    uint at = path * (VPL_FIRST_NUMBERS + 2u * settings.bounces) + 2u * pair;
    return vec2(numbers[at], numbers[at + 1u]);
}

// Parallel light along `direction` enters the scene's box through three faces; the projected area of each, m².
vec3 entered_areas(vec3 direction) {
    vec3 size = settings.high - settings.low;
    return abs(direction) * vec3(size.y * size.z, size.z * size.x, size.x * size.y);
}

// A point where parallel light enters the box, distributed uniformly over the box's cross-section.
vec3 entry(vec3 direction, vec2 u) {
    vec3 areas = entered_areas(direction);
    float pick = u.x * (areas.x + areas.y + areas.z);
    uint axis = pick < areas.x ? 0u : pick < areas.x + areas.y ? 1u : 2u;
    // The remainder of the number is uniformly distributed again and serves as the next number.
    float before = axis == 0u ? 0.0 : axis == 1u ? areas.x : areas.x + areas.y;
    float v = clamp((pick - before) / max(areas[axis], 1e-30), 0.0, 1.0);
    vec3 place = axis == 0u ? vec3(0.0, v, u.y) : axis == 1u ? vec3(v, 0.0, u.y) : vec3(v, u.y, 0.0);
    place[axis] = direction[axis] > 0.0 ? 0.0 : 1.0;
    vec3 size = settings.high - settings.low;
    // The ray starts a little in front of the face, so that it hits surfaces that lie in the face.
    return settings.low + place * size - direction * (1e-3 * length(size));
}

VplPath begun(uint at) {
    VplStart start = starts[at];
    VplPath path;
    path.origin = vec3(0.0);
    path.direction = vec3(0.0, 1.0, 0.0);
    path.flux = vec3(0.0);
    path.alive = 0u;
    path.depth = 0u;
    path.range = 0.0;
    path.specular = 0u;
    vec2 first = number_pair(at, 0u);
    vec2 second = number_pair(at, 1u);
    if (start.kind == START_TRIANGLE) {
        SurfacePoint point = surface_point(start.instance, start.index, sample_triangle(second));
        vec3 side = normalize(point.area);
        bool both = (materials[surface_instances[start.instance].material].flags & MATERIAL_DOUBLE_SIDED) != 0u;
        if (both) {
            side = first.x < 0.5 ? side : -side;
            first.x = first.x < 0.5 ? 2.0 * first.x : 2.0 * first.x - 1.0;
        }
        float area = 0.5 * length(point.area) * (both ? 2.0 : 1.0);
        path.flux = triangle_radiance(start.instance, point, settings.two) * (SAMPLING_PI * area);
        path.origin = point.position + side * surface_gap(point);
        path.direction = frame_around(side) * sample_cosine(first);
    } else if (start.kind == START_ENVIRONMENT) {
        uvec4 words = pcg4d(uvec4(at, settings.seed, 0x5e1fu, 0u));
        float density;
        // The Halton numbers have 24 bits. The other bits are hashed random numbers.
        uvec2 bits = uvec2(second * 16777216.0) << 8u | words.xy >> 24u;
        vec3 sky = environment_sample(settings.environment, bits, density);
        vec3 areas = entered_areas(sky);
        path.direction = -sky;
        path.origin = entry(-sky, first);
        if (density > 0.0) path.flux = environment_radiance(settings.environment, sky) * ((areas.x + areas.y + areas.z) / density);
    } else {
        Light one = light(start.index);
        path.origin = one.position;
        path.range = one.range;
        if (one.kind == LIGHT_DIRECTIONAL) {
            vec3 areas = entered_areas(one.direction);
            path.direction = one.direction;
            path.origin = entry(one.direction, first);
            path.flux = one.intensity * (areas.x + areas.y + areas.z);
            path.range = 0.0;
        } else if (one.kind == LIGHT_SPOT) {
            // The intensity is the square of a ramp that is linear in the cosine between the outer and the inner cone, and 1 inside. In
            // narrow cones rounding may place the inner cosine above 1, and the ramp ends before it reaches 1.
            float outer = clamp(-one.spot_offset / one.spot_scale, -1.0, 1.0);
            float inner = (1.0 - one.spot_offset) / one.spot_scale;
            float end = min(inner, 1.0);
            float reached = clamp((end - outer) / max(inner - outer, 1e-30), 0.0, 1.0);
            float full = 1.0 - end, rim = (inner - outer) / 3.0 * (reached * reached * reached);
            float pick = first.x * (full + rim);
            float cosine = pick < rim ? outer + (end - outer) * pow(pick / max(rim, 1e-30), 1.0 / 3.0)
                : end + (pick - rim);
            cosine = clamp(cosine, -1.0, 1.0);
            float phi = 2.0 * SAMPLING_PI * first.y;
            float sine = sqrt(max(1.0 - cosine * cosine, 0.0));
            path.direction = frame_around(normalize(one.direction)) * vec3(sine * cos(phi), sine * sin(phi), cosine);
            path.flux = one.intensity * (2.0 * SAMPLING_PI * (full + rim));
        } else {
            path.direction = sample_sphere(first);
            path.flux = one.intensity * (4.0 * SAMPLING_PI);
        }
    }
    path.direction = normalize(path.direction);
    path.flux *= start.weight;
    path.alive = path.flux == vec3(0.0) || any(isnan(path.flux)) || any(isinf(path.flux)) ? 0u : 1u;
    return path;
}

void main() {
    uint at = gl_GlobalInvocationID.x;
    if (at >= settings.paths) return;
    VplPath path;
    if (turn == 0u) {
        path = begun(at);
    } else {
        path = paths[at];
    }
    if (path.alive == 0u) {
        paths[at] = path;
        return;
    }
    uvec4 words = pcg4d(uvec4(at, turn, settings.seed, 0xb0c5u));
    Hit hit = trace_closest(Ray(path.origin, 0.0, path.direction, 1e30), TRACE_SHADOW, words.x);
    path.alive = 0u;
    if (hit.instance != NONE) {
        HitSurface s = hit_surface(hit, path.direction, settings.slots, settings.diffuse_only != 0u);
        if (path.range > 0.0) {
            float q = hit.t / path.range;
            path.flux *= clamp(1.0 - q * q * q * q, 0.0, 1.0);
            path.range = 0.0;
        }
        // On a surface that is partly glass the path chooses the rough part or the sharp part at random. Only the rough part leaves a
        // virtual light, because light that is transmitted or mirrored has not bounced diffusely.
        bool on = unit_float(words.y) < s.rough;
        bool left = on && s.albedo != vec3(0.0);
        uint depth = path.depth;
        // The path's flux arrives by the cosine of the geometric normal, but the surface receives by the cosine of the shading normal. At
        // grazing angles the ratio of the two has no limit, so it is clamped.
        float slant = max(dot(s.normal, -path.direction), 0.0) / max(dot(s.side, -path.direction), 1e-6);
        vec3 reflected = path.flux * s.albedo * min(slant, 4.0);
        if (left) {
            vpls[depth * settings.paths + at] = Vpl(s.position, s.gap, s.side, depth, reflected, at);
            path.depth += 1u;
        }
        bool room = path.depth < settings.bounces;
        if (on) {
            path.flux = reflected;
            path.direction = normalize(frame_around(s.side) * sample_cosine(number_pair(at, 2u + depth)));
            path.origin = s.position + s.side * s.gap;
            path.alive = room && left ? 1u : 0u;
        } else {
            float cosine = clamp(-dot(s.normal, path.direction), 0.0, 1.0);
            bool through = false;
            if (unit_float(words.z) * (s.glass + s.mirror) >= s.glass) {
                path.flux *= schlick(s.tint, cosine);
            } else {
                float f = fresnel_dielectric(cosine, s.eta);
                if (s.thin) f = fresnel_sheet(f);
                through = unit_float(words.w) >= f;
                if (through) path.flux *= s.tint;
            }
            vec3 ahead = !through ? reflect(path.direction, s.normal)
                : s.thin ? path.direction : refract(path.direction, s.normal, 1.0 / s.eta);
            path.origin = s.position + (through ? -s.side : s.side) * s.gap;
            path.specular += 1u;
            path.alive = room && path.specular <= settings.specular_depth && ahead != vec3(0.0) ? 1u : 0u;
            if (path.alive != 0u) path.direction = normalize(ahead);
        }
        if (path.flux == vec3(0.0)) path.alive = 0u;
    }
    paths[at] = path;
}
