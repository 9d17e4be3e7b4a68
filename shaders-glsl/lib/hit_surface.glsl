// Attributes at a point of a triangle, for rays: what the rasteriser interpolates for passes/gbuffer.frag.
// Before including: lib/scene.glsl, and define SURFACE_BINDING, the first of seven bindings.
#ifndef LIB_HIT_SURFACE
#define LIB_HIT_SURFACE
#include "lib/scene_at.glsl"

layout(binding = SURFACE_BINDING, scalar) readonly buffer SurfaceInstances { Instance surface_instances[]; };
layout(binding = SURFACE_BINDING + 1, scalar) readonly buffer SurfaceIndices { uint surface_indices[]; };
layout(binding = SURFACE_BINDING + 2, scalar) readonly buffer SurfacePositions { vec3 surface_positions[]; };
layout(binding = SURFACE_BINDING + 3, scalar) readonly buffer SurfaceNormals { vec3 surface_normals[]; };
layout(binding = SURFACE_BINDING + 4, scalar) readonly buffer SurfaceTangents { vec4 surface_tangents[]; };
layout(binding = SURFACE_BINDING + 5, scalar) readonly buffer SurfaceUvs { vec2 surface_uvs[]; };
layout(binding = SURFACE_BINDING + 6, scalar) readonly buffer SurfaceColors { vec4 surface_colors[]; };

struct SurfacePoint {
    vec3 position;  // world, metres
    vec3 area;      // world normal of the front, twice the triangle's area long
    float reach;    // largest coordinate of the corners: rounding errors are a share of it
    uvec3 vertices; // of the primitive
    vec3 weights;   // of the vertices
};

// Numbers of a triangle's vertices in its primitive.
uvec3 surface_vertices(uint instance, uint triangle) {
    uint first = INSTANCE_AT(instance).first_index + 3u * triangle;
    return uvec3(INDEX_AT(first), INDEX_AT(first + 1u), INDEX_AT(first + 2u));
}

// World positions of the vertices, metres.
vec3[3] surface_corners(uint instance, uvec3 vertices) {
    mat4 m = INSTANCE_AT(instance).world_from_object;
    uint at = INSTANCE_AT(instance).first_vertex;
    vec3 a = (m * vec4(POSITION_AT(at + vertices.x), 1.0)).xyz;
    vec3 b = (m * vec4(POSITION_AT(at + vertices.y), 1.0)).xyz;
    vec3 c = (m * vec4(POSITION_AT(at + vertices.z), 1.0)).xyz;
    return vec3[](a, b, c);
}

SurfacePoint surface_point(uint instance, uint triangle, vec2 barycentrics) {
    SurfacePoint p;
    p.vertices = surface_vertices(instance, triangle);
    p.weights = vec3(1.0 - barycentrics.x - barycentrics.y, barycentrics);
    vec3 corners[3] = surface_corners(instance, p.vertices);
    vec3 a = corners[0], b = corners[1], c = corners[2];
    p.position = p.weights.x * a + p.weights.y * b + p.weights.z * c;
    p.area = cross(b - a, c - a);
    if ((INSTANCE_AT(instance).flags & INSTANCE_FLIPPED) != 0u) p.area = -p.area;
    vec3 most = max(max(abs(a), abs(b)), abs(c));
    p.reach = max(most.x, max(most.y, most.z));
    return p;
}

// World shading normal of the front, without normal map; not normalised.
vec3 surface_normal(uint instance, SurfacePoint p) {
    uint at = INSTANCE_AT(instance).first_vertex;
    vec3 n = p.weights.x * NORMAL_AT(at + p.vertices.x) + p.weights.y * NORMAL_AT(at + p.vertices.y)
        + p.weights.z * NORMAL_AT(at + p.vertices.z);
    return INSTANCE_AT(instance).normal_from_object * n;
}

// World tangent, not normalised, and the side of the bitangent.
vec4 surface_tangent(uint instance, SurfacePoint p) {
    uint at = INSTANCE_AT(instance).first_vertex;
    vec4 t = p.weights.x * TANGENT_AT(at + p.vertices.x) + p.weights.y * TANGENT_AT(at + p.vertices.y)
        + p.weights.z * TANGENT_AT(at + p.vertices.z);
    float side = (INSTANCE_AT(instance).flags & INSTANCE_FLIPPED) != 0u ? -1.0 : 1.0;
    return vec4(mat3(INSTANCE_AT(instance).world_from_object) * t.xyz, t.w * side);
}

vec2 surface_uv(uint instance, SurfacePoint p, uint set) {
    uint at = INSTANCE_AT(instance).uv_first[min(set, 3u)];
    if (at == NONE) return vec2(0.0);
    return p.weights.x * UV_AT(at + p.vertices.x) + p.weights.y * UV_AT(at + p.vertices.y)
        + p.weights.z * UV_AT(at + p.vertices.z);
}

vec4 surface_color(uint instance, SurfacePoint p) {
    uint at = INSTANCE_AT(instance).color_first;
    if (at == NONE) return vec4(1.0);
    return p.weights.x * COLOR_AT(at + p.vertices.x) + p.weights.y * COLOR_AT(at + p.vertices.y)
        + p.weights.z * COLOR_AT(at + p.vertices.z);
}

// How far to step off a surface so that rounding cannot put the start on the wrong side.
float surface_gap(SurfacePoint p) {
    return max(p.reach, 1e-6) * 1e-5;
}

// The shading normal, bent towards that of the triangle, n, as far as it takes for light to be mirrored above the triangle: normal
// maps and interpolated normals may lean so far that a mirror would show its own inside. v: unit, towards the viewer, above n.
// Twin: reference::path::surface.
vec3 mirroring_normal(vec3 shading, vec3 n, vec3 v) {
    float along = dot(v, n);
    // At most as steep as the light goes out, so that the triangle's own normal always does.
    float least = min(0.9 * along, 0.025);
    if (2.0 * dot(shading, v) * dot(shading, n) - along >= least) return shading;
    vec3 x = shading - dot(shading, n) * n;
    if (dot(x, x) < 1e-12 || along <= 0.0) return n;
    x = normalize(x);
    // In the plane of both normals: 2 (m·v) (m·n) - v·n = least for m = sin x + cos n, solved for cos².
    float across = dot(v, x);
    float a = across * across + along * along;
    float b = a + along * least;
    float c = along + least;
    float root = sqrt(max(b * b - a * c * c, 0.0));
    float cos2 = clamp(0.5 * (across < 0.0 ? b + root : b - root) / a, 0.0, 1.0);
    return normalize(sqrt(1.0 - cos2) * x + sqrt(cos2) * n);
}

#endif
