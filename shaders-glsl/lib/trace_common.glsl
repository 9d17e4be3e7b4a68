// What every way to trace has in common: rays, hits, the triangle test, and what is cut out of triangles.
#ifndef LIB_TRACE_COMMON
#define LIB_TRACE_COMMON
#include "lib/scene.glsl"
#include "lib/material.glsl"
#include "lib/random.glsl"
#include "lib/ray.glsl"

// Turns that the loops of the last compute traversal took, for tests and benchmarks.
uint trace_turns = 0u;

#ifdef TRACE_BOXES
// 1: boxes of triangles stand for them: of any hit, in compute (Marques and Santos, section 4.1). A box that holds an end of the ray
// says nothing; its triangle is tested. What is in the way is then in the way too, and more.
layout(constant_id = 15) const uint IMPERFECT = 0u;
#endif

const uint TRACE_CAMERA = 1u; // back faces of single-sided surfaces are not there (as rasterised)
const uint TRACE_SHADOW = 2u; // unlit surfaces do not stop light
const uint TRACE_SOLID = 4u;  // blended surfaces are there, but where nothing of them is

// Bits that a triangle's record has about its surface.
const uint TRACE_SINGLE_SIDED = 1u; // export
const uint TRACE_REVERSED = 2u; // export
const uint TRACE_CUTOUT = 4u; // export
const uint TRACE_UNLIT = 8u; // export

layout(binding = 43, scalar) readonly buffer TraceIndices { uint trace_indices[]; };
layout(binding = 44, scalar) readonly buffer TraceUvs { vec2 trace_uvs[]; };
layout(binding = 45, scalar) readonly buffer TraceColors { vec4 trace_colors[]; };
layout(binding = 46, scalar) readonly buffer TraceScene { Instance trace_scene[]; };

// Whether the surface is there by its alpha: cut out below the cutoff; where blended with probability alpha, and always for rays with
// TRACE_SOLID.
bool trace_covered(uint instance, uint triangle, vec2 barycentrics, uint mask, uint salt) {
    uint m = trace_scene[instance].material;
    uint flags = materials[m].flags;
    float alpha = materials[m].base_color.a;
    vec3 w = vec3(1.0 - barycentrics.x - barycentrics.y, barycentrics);
    uint at = trace_scene[instance].first_index + 3u * triangle;
    uvec3 corner = uvec3(trace_indices[at], trace_indices[at + 1u], trace_indices[at + 2u]);
    uint color = trace_scene[instance].color_first;
    if (color != NONE) {
        vec3 alphas = vec3(trace_colors[color + corner.x].a, trace_colors[color + corner.y].a, trace_colors[color + corner.z].a);
        alpha *= dot(alphas, w);
    }
    if (has_texture(flags, TEXTURE_BASE_COLOR)) {
        TextureUse use = materials[m].textures[TEXTURE_BASE_COLOR];
        uint first = trace_scene[instance].uv_first[use.uv_set];
        vec2 uv = vec2(0.0);
        if (first != NONE) {
            uv = trace_uvs[first + corner.x] * w.x + trace_uvs[first + corner.y] * w.y + trace_uvs[first + corner.z] * w.z;
        }
        // A hit has no neighbours to take a level from; the finest cuts exactly.
        alpha *= sample_texture(use, uv, 0.0).a;
    }
    bool blended = (flags & MATERIAL_BLEND) != 0u;
    bool solid = (mask & TRACE_SOLID) != 0u;
    float cutoff = !blended ? materials[m].alpha_cutoff : solid ? 0.0 : random_float(uvec4(salt, instance, triangle, 0u));
    // A random number of 0 must not show what is not there.
    return alpha >= cutoff && !(blended && alpha <= 0.0);
}

// A ray sheared to the +z axis (Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection", JCGT 2013).
struct TraceShear {
    uint axis;  // along which the direction is longest
    bool swap;  // keeps the winding
    vec3 scale; // d.x / d.z, d.y / d.z, 1 / d.z after turning
};

// (x, y, z) with z = `axis`, in the order that keeps the winding.
vec3 trace_turned(vec3 v, uint axis, bool swap) {
    vec3 r = axis == 0u ? v.yzx : axis == 1u ? v.zxy : v;
    return swap ? r.yxz : r;
}

TraceShear trace_shear(vec3 direction) {
    vec3 size = abs(direction);
    uint axis = size.x > size.y && size.x > size.z ? 0u : size.y > size.z ? 1u : 2u;
    TraceShear shear;
    shear.axis = axis;
    shear.swap = (axis == 0u ? direction.x : axis == 1u ? direction.y : direction.z) < 0.0;
    vec3 d = trace_turned(direction, axis, shear.swap);
    shear.scale = vec3(d.x / d.z, d.y / d.z, 1.0 / d.z);
    return shear;
}

// Hit of the line with a triangle: (t, weight of b, weight of c) and the sign of the side that is seen (1: counter-clockwise);
// 0 where it misses. An edge's sign is decided by two products in the same way for both triangles that share it: rounding
// may give 0, never the wrong sign, and 0 counts as inside, so no ray passes between them.
float trace_triangle(vec3 a, vec3 b, vec3 c, vec3 origin, TraceShear shear, out vec3 at) {
    precise vec3 p = trace_turned(a - origin, shear.axis, shear.swap);
    precise vec3 q = trace_turned(b - origin, shear.axis, shear.swap);
    precise vec3 r = trace_turned(c - origin, shear.axis, shear.swap);
    precise float px = p.x - shear.scale.x * p.z, py = p.y - shear.scale.y * p.z;
    precise float qx = q.x - shear.scale.x * q.z, qy = q.y - shear.scale.y * q.z;
    precise float rx = r.x - shear.scale.x * r.z, ry = r.y - shear.scale.y * r.z;
    precise float u = rx * qy - ry * qx;
    precise float v = px * ry - py * rx;
    precise float w = qx * py - qy * px;
    precise float determinant = u + v + w;
    precise float z = u * (shear.scale.z * p.z) + v * (shear.scale.z * q.z) + w * (shear.scale.z * r.z);
    at = vec3(z, v, w) / determinant;
    bool outside = min(u, min(v, w)) < 0.0 && max(u, max(v, w)) > 0.0;
    return outside || determinant == 0.0 ? 0.0 : determinant > 0.0 ? 1.0 : -1.0;
}

// Whether a surface with these bits, seen from `side`, is there for rays with this mask.
bool trace_counts(uint surface, float side, uint mask) {
    bool reversed = (surface & TRACE_REVERSED) != 0u;
    bool back = reversed ? side > 0.0 : side < 0.0;
    bool hidden = (mask & TRACE_CAMERA) != 0u && (surface & TRACE_SINGLE_SIDED) != 0u && back;
    bool unlit = (mask & TRACE_SHADOW) != 0u && (surface & TRACE_UNLIT) != 0u;
    return side != 0.0 && !hidden && !unlit;
}

#endif
