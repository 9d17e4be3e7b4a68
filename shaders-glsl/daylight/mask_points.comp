// Chooses the points of the sun masks that paths request. A point under a thing that stands on a surface, or in a wall that stands in it, would make
// the mask of its whole cell dark. So each of a few random points sends a few rays, and the first point from which one of them comes to
// something is taken.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/scene.glsl"
#include "lib/random.glsl"
#include "lib/material.glsl"
#include "lib/sampling.glsl"
#define SURFACE_BINDING 1
#include "lib/hit_surface.glsl"
#include "lib/trace.glsl"
#include "daylight/daylight.glsl"

layout(local_size_x = DAY_VISIBILITY_GROUP) in;

layout(binding = 0, scalar) uniform SettingsBlock { DaySettings settings; };
layout(binding = 9, scalar) readonly buffer Wanted { uint wanted[]; };  // as in daylight/walk.glsl
layout(binding = 10, scalar) readonly buffer Requests { DayRequests requests; };
layout(binding = 12, scalar) writeonly buffer MaskPoints { DayMaskPoint points[]; };
layout(binding = 13, scalar) readonly buffer Cells { DayCells cells[]; };
layout(binding = 14, scalar) readonly buffer CellFirsts { uint cell_firsts[]; };

#include "daylight/masks.glsl"
#include "daylight/sun_ray.glsl"

// Random points of a cell, and rays of each.
const uint POINTS = 4u;
const uint RAYS = 3u;
// Of rays that end under a thing, metres.
const float SHORT = 0.1;

layout(push_constant, scalar) uniform Push {
    uint triangles;  // of all instances
    uint instances;
    float spacing;   // of the points, metres
};

// The last triangle whose first cell is not above `cell`.
uint triangle_of(uint cell) {
    uint low = 0u, high = triangles;
    while (high - low > 1u) {
        uint middle = (low + high) / 2u;
        if (cells[middle].first <= cell) low = middle;
        else high = middle;
    }
    return low;
}

// The last instance whose first triangle is not above `triangle`.
uint instance_of(uint triangle) {
    uint low = 0u, high = instances;
    while (high - low > 1u) {
        uint middle = (low + high) / 2u;
        if (cell_firsts[middle] <= triangle) low = middle;
        else high = middle;
    }
    return low;
}

// Whether a ray is not short, and does not hit the inside of a solid.
bool is_long(vec3 from, vec3 direction, uint salt) {
    Hit hit = trace(Ray(from, 0.0, direction, 1e30), TRACE_SHADOW, salt, false);
    if (hit.instance == NONE) return true;
    if (hit.t < min(0.5 * spacing, SHORT)) return false;
    bool thin = (MATERIAL_AT(INSTANCE_AT(hit.instance).material).flags & MATERIAL_DOUBLE_SIDED) != 0u;
    return thin || dot(surface_point(hit.instance, hit.triangle, hit.barycentrics).area, direction) < 0.0;
}

void main() {
    uint request = gl_GlobalInvocationID.x;
    if (request >= requests.count) return;
    uint side = wanted[request];
    uint cell = side >> 1u;
    bool back = (side & 1u) != 0u;
    uint of_all = triangle_of(cell);
    uint instance = instance_of(of_all);
    uvec4 hash = pcg4d(uvec4(side, 0x2545f491u, settings.seed, 7u));
    DayMaskPoint first;
    bool found = false;
    for (uint i = 0u; i < POINTS && !found; ++i) {
        hash = pcg4d(hash);
        vec2 barycentrics = day_cell_point(cells[of_all], cell, unit_floats(hash.xy));
        SurfacePoint point = surface_point(instance, of_all - cell_firsts[instance], barycentrics);
        vec3 normal = normalize(back ? -point.area : point.area);
        vec3 above = point.position + normal * (2.0 * surface_gap(point));
        vec2 disc = day_sun_disc(hash.zw, settings.sun_radius);
        DayMaskPoint candidate = DayMaskPoint(above, normal, disc, hash.z, side);
        if (i == 0u) first = candidate;
        mat3 around = frame_around(normal);
        for (uint k = 0u; k < RAYS && !found; ++k) {
            hash = pcg4d(hash);
            found = is_long(above, around * sample_cosine(unit_floats(hash.xy)), hash.z);
        }
        if (found) first = candidate;
    }
    points[request] = first;
}
