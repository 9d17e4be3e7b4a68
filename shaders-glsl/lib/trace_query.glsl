// Tracing by hardware ray query. Only in the variant of a shader that defines TRACE_QUERY; lucerna::rays builds what it traces.
#ifndef LIB_TRACE_QUERY
#define LIB_TRACE_QUERY

layout(binding = 47) uniform accelerationStructureEXT trace_accel;

// Bits of the masks of instances: a surface is one or the other.
const uint TRACE_SEES_LIT = 1u; // export
const uint TRACE_SEES_UNLIT = 2u; // export
// Cut out candidates of one ray; a ray that meets more ends with what it has. CPU drivers stop loops at 65,535.
const uint TRACE_CANDIDATES = 30000u;

Hit trace(Ray ray, uint mask, uint salt, bool any) {
    Hit hit = Hit(ray.t_max, vec2(0.0), NONE, NONE);
    // A query must have 0 <= t_min <= t_max, and a direction that its own arithmetic can square.
    vec3 size = abs(ray.direction);
    int exponent;
    float mantissa = frexp(max(size.x, max(size.y, size.z)), exponent);
    // Powers of two: nothing is rounded.
    float scale = ldexp(1.0, clamp(exponent, -126, 126));
    float start = min(ray.t_min, 0.0);
    vec3 origin = ray.origin + start * ray.direction;
    float t_min = (ray.t_min - start) * scale, t_max = (ray.t_max - start) * scale;
    if (!(t_min <= t_max) || mantissa == 0.0 || isinf(mantissa)) {
        return hit;
    }
    uint flags = gl_RayFlagsNoneEXT;
    if ((mask & TRACE_CAMERA) != 0u) flags |= gl_RayFlagsCullBackFacingTrianglesEXT; // double-sided instances forbid it
    if (any) flags |= gl_RayFlagsTerminateOnFirstHitEXT;
    uint sees = (mask & TRACE_SHADOW) != 0u ? TRACE_SEES_LIT : TRACE_SEES_LIT | TRACE_SEES_UNLIT;
    rayQueryEXT query;
    rayQueryInitializeEXT(query, trace_accel, flags, sees, origin, t_min, ray.direction / scale, t_max);
    // Only triangles of cut out surfaces come as candidates.
    for (uint left = TRACE_CANDIDATES; left > 0u && rayQueryProceedEXT(query); --left) {
        uint instance = uint(rayQueryGetIntersectionInstanceCustomIndexEXT(query, false));
        uint triangle = uint(rayQueryGetIntersectionPrimitiveIndexEXT(query, false));
        vec2 barycentrics = rayQueryGetIntersectionBarycentricsEXT(query, false);
        if (trace_covered(instance, triangle, barycentrics, mask, salt)) {
            rayQueryConfirmIntersectionEXT(query);
        }
    }
    if (rayQueryGetIntersectionTypeEXT(query, true) == gl_RayQueryCommittedIntersectionTriangleEXT) {
        hit.t = rayQueryGetIntersectionTEXT(query, true) / scale + start;
        hit.barycentrics = rayQueryGetIntersectionBarycentricsEXT(query, true);
        hit.instance = uint(rayQueryGetIntersectionInstanceCustomIndexEXT(query, true));
        hit.triangle = uint(rayQueryGetIntersectionPrimitiveIndexEXT(query, true));
    }
    return hit;
}

// A ray on its way. The driver traces it in one step.
struct Traversal {
    Ray ray;
    uint mask;
    uint salt;
    Hit hit;
    bool done;
};

Traversal trace_begin(Ray ray, uint mask, uint salt) {
    return Traversal(ray, mask, salt, Hit(ray.t_max, vec2(0.0), NONE, NONE), false);
}

void trace_step(inout Traversal t, bool any) {
    t.hit = trace(t.ray, t.mask, t.salt, any);
    t.done = true;
}

Hit trace_end(Traversal t) {
    return t.hit;
}

#endif
