// Walks the paths of baked daylight from receivers through the scene. Their vertices do not depend on the light, so that one set of paths serves
// all times of the day. Receivers are points on surfaces, or with PROBES points in space.
#include "lib/scene.glsl"
#include "lib/random.glsl"
#include "lib/material.glsl"
#include "lib/sampling.glsl"
#include "lib/brdf.glsl"
#include "lib/bsdf.glsl"
#include "lib/points.glsl"
#define SURFACE_BINDING 1
#include "lib/hit_surface.glsl"
#include "lib/trace.glsl"
#include "daylight/daylight.glsl"
#include "daylight/surface.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) uniform SettingsBlock { DaySettings settings; };
#ifdef PROBES
layout(binding = 8, scalar) readonly buffer Probes { vec3 probes[]; };
// The first part of each path.
layout(binding = 12, scalar) writeonly buffer Starts { DayStart starts[]; };
#else
// Their t is positive for the front of a triangle and negative for its back.
layout(binding = 8, scalar) readonly buffer Receivers { Hit receivers[]; };
layout(binding = 14, scalar) writeonly buffer Spots { DaySpot spots[]; };
// For each receiver of a lightmap: the paths that begin inside of a solid, or under an object that lies on the surface; then those that do so if
// surfaces with two sides are those of solids.
layout(binding = 20, scalar) buffer Shut { uint shut[]; };
#endif
layout(binding = 9, scalar) writeonly buffer Vertices { DayVertex vertices[]; };
layout(binding = 10, scalar) writeonly buffer Escapes { DayEscape escapes[]; };
layout(binding = 11, scalar) writeonly buffer Counts { uint counts[]; };
layout(binding = 15, scalar) readonly buffer Cells { DayCells cells[]; };
layout(binding = 16, scalar) readonly buffer CellFirsts { uint cell_firsts[]; };
// A bit for each side of a cell: whether its mask is there, or requested.
layout(binding = 17, scalar) coherent buffer Known { uint known[]; };
// Sides of cells: those that are new.
layout(binding = 18, scalar) writeonly buffer Wanted { uint wanted[]; };
layout(binding = 19, scalar) buffer Requests { DayRequests requests; };

#include "daylight/masks.glsl"

// Requests a mask if it is not there.
void request_mask(uint side) {
    uint bit = 1u << (side & 31u);
    if ((known[side >> 5u] & bit) != 0u || (atomicOr(known[side >> 5u], bit) & bit) != 0u) return;
    uint at = atomicAdd(requests.count, 1u);
    wanted[at] = side;
    atomicMax(requests.point_groups.x, at / DAY_VISIBILITY_GROUP + 1u);
    atomicMax(requests.ray_groups.x, at / (DAY_VISIBILITY_GROUP * settings.places) + 1u);
}

void main() {
    uint path = gl_GlobalInvocationID.x;
    if (path >= settings.receivers * settings.samples) return;
    uint receiver = path / settings.samples;
    uint number = settings.first_sample + path % settings.samples;
    uint count = 0u;
    DayEscape escape = DayEscape(vec3(0.0), vec3(0.0));
#ifndef PROBES
    Hit at = receivers[receiver];
    if (at.instance != NONE)
#endif
    {
        bool diffuse_only = (settings.flags & DAY_DIFFUSE_ONLY) != 0u;
        bool smooth_only = (settings.flags & DAY_NORMAL_MAPS) == 0u;
        uint of_bake = settings.first_receiver + receiver;
        PointPlace place = point_place(uvec2(of_bake & 0xffffu, of_bake >> 16u), number, POINTS_APART, settings.seed);
        // Probes multiply the weight by 4 and by the harmonics of the direction in which the path starts: all directions are equally likely.
        vec3 weight = vec3(SAMPLING_PI);
#ifdef PROBES
        DaySurface s;
        vec3 origin = probes[receiver];
        vec3 direction = sample_sphere(unit_floats(point_words(place, 0u, settings.seed)));
        bool alive = true;
        DayStart start = DayStart(direction, DAY_FAR);
#else
        SurfacePoint point = surface_point(at.instance, at.triangle, at.barycentrics);
        vec3 toward = at.t < 0.0 ? normalize(point.area) : -normalize(point.area);
        DaySurface s = day_surface(at.instance, at.triangle, at.barycentrics, toward, diffuse_only, smooth_only);
        vec3 origin = s.position + (s.side - toward) * s.gap;
        if (path % settings.samples == 0u) spots[receiver] = DaySpot(s.position, s.side, origin, s.normal);
        vec3 direction = frame_around(s.normal) * sample_cosine(unit_floats(point_words(place, 0u, settings.seed)));
        bool alive = dot(direction, s.side) > 0.0;
#endif
        uint sharp = 0u;
        float first_largest = 0.0;
        for (uint surface = 1u; alive; ++surface) {
            uint salt = pcg4d(uvec4(of_bake, number, surface, settings.seed)).x;
            Hit hit = trace(Ray(origin, 0.0, direction, 1e30), TRACE_SHADOW, salt, false);
            if (hit.instance == NONE) {
                escape = DayEscape(direction, weight);
                break;
            }
            s = day_surface(hit.instance, hit.triangle, hit.barycentrics, direction, diffuse_only, false);
#ifdef PROBES
            if (surface == 1u) start.distance = s.inside ? -hit.t : hit.t;
#else
            if (surface == 1u && settings.touching > 0.0) {
                bool near = hit.t < settings.touching;
                // Light goes through glass.
                if (s.glass == 0.0 && (near || s.inside)) atomicAdd(shut[2u * receiver], 1u);
                if (s.glass == 0.0 && (near || !s.front)) atomicAdd(shut[2u * receiver + 1u], 1u);
            }
#endif
            if (s.unlit) break;
            vec3 above = s.position + (s.side - direction) * s.gap;
            float go = s.mirror + s.glass;
            float pick = 1.0;
            if (go > 0.0) pick = unit_float(point_words(place, 2u * surface + 1u, settings.seed).x);
            if (pick < go) {
                if (++sharp > settings.sharp) break;
                float cosine = clamp(-dot(s.normal, direction), 0.0, 1.0);
                if (pick >= s.glass) {
                    weight *= schlick(s.tint, cosine);
                    direction = reflect(direction, s.normal);
                    alive = dot(direction, s.side) > 0.0;
                    origin = above;
                } else {
                    float f = fresnel_dielectric(cosine, s.eta);
                    if (s.thin) f = fresnel_sheet(f);
                    if (pick < f * s.glass) {
                        direction = reflect(direction, s.normal);
                        origin = above;
                    } else {
                        weight *= s.tint;
                        // Radiance is scaled with the square of the refractive index on the way in, and back on the way out.
                        if (!s.thin) {
                            weight /= s.eta * s.eta;
                            direction = refract(direction, s.normal, 1.0 / s.eta);
                        }
                        origin = s.position - s.side * s.gap;
                        alive = direction != vec3(0.0);
                    }
                }
                continue;
            }
            weight *= s.albedo;
            float largest = brightest(weight) / SAMPLING_PI;
            if (count == 0u) first_largest = largest;
            uint side = 0u;
            if ((settings.flags & DAY_SUN_MASKS) != 0u) {
                side = 2u * day_cell(hit.instance, hit.triangle, hit.barycentrics) + (s.front ? 0u : 1u);
                request_mask(side);
            }
            float share = first_largest > 0.0 ? largest / first_largest : 0.0;
            vertices[path * DAY_VERTICES + count] = DayVertex(above, s.normal, s.side, weight / SAMPLING_PI, share, side);
            ++count;
            if (count >= settings.bounces) break;
            if (count > settings.roulette && largest < 0.25) {
                float stay = 4.0 * largest;
                if (unit_float(pcg4d(uvec4(salt, 1u, 2u, 3u)).x) >= stay) break;
                weight /= max(stay, 1e-20);
            }
            direction = frame_around(s.normal) * sample_cosine(unit_floats(point_words(place, 2u * surface, settings.seed)));
            alive = dot(direction, s.side) > 0.0 && largest > 0.0;
            origin = above;
        }
#ifdef PROBES
        starts[path] = start;
#endif
    }
    counts[path] = count;
    escapes[path] = escape;
}
