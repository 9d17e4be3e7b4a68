// One ray a thread by hardware ray query, without lib/trace.glsl: tests acceleration structures by themselves.
#version 460
#extension GL_EXT_ray_query : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 64) in;

struct QueryRay {
    vec3 origin;
    float t_max;
    vec3 direction;
    uint mask;
};

struct QueryHit {
    float t; // negative: nothing
    uint instance;
    uint triangle;
    uint front;
    vec2 barycentrics;
};

layout(binding = 0) uniform accelerationStructureEXT top;
layout(binding = 1, scalar) readonly buffer Rays { QueryRay rays[]; };
layout(binding = 2, scalar) writeonly buffer Hits { QueryHit hits[]; };
layout(push_constant, scalar) uniform Push { uint count; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    QueryRay ray = rays[i];
    rayQueryEXT query;
    rayQueryInitializeEXT(query, top, gl_RayFlagsOpaqueEXT, ray.mask, ray.origin, 0.0, ray.direction, ray.t_max);
    rayQueryProceedEXT(query);
    QueryHit hit = QueryHit(-1.0, 0u, 0u, 0u, vec2(0.0));
    if (rayQueryGetIntersectionTypeEXT(query, true) == gl_RayQueryCommittedIntersectionTriangleEXT) {
        hit.t = rayQueryGetIntersectionTEXT(query, true);
        hit.instance = uint(rayQueryGetIntersectionInstanceCustomIndexEXT(query, true));
        hit.triangle = uint(rayQueryGetIntersectionPrimitiveIndexEXT(query, true));
        hit.front = rayQueryGetIntersectionFrontFaceEXT(query, true) ? 1u : 0u;
        hit.barycentrics = rayQueryGetIntersectionBarycentricsEXT(query, true);
    }
    hits[i] = hit;
}
