// Importance of each candidate: adds the luminance that it sends to a range of the visible points.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/random.glsl"
#include "lib/trace.glsl"
#include "lib/vpl.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) readonly buffer Candidates { Vpl candidates[]; };
layout(binding = 1, scalar) readonly buffer Points { SeenPoint points[]; };
layout(binding = 2, scalar) buffer Importances { float importances[]; };

layout(push_constant, scalar) uniform Push {
    uint total; // candidates
    uint first; // point
    uint count;
    float near; // distance below which the light is damped, metres
    uint seed;
};

void main() {
    uint at = gl_GlobalInvocationID.x;
    if (at >= total) return;
    Vpl vpl = candidates[at];
    if (vpl.flux == vec3(0.0)) return;
    float sum = 0.0;
    for (uint i = first; i < first + count; ++i) {
        SeenPoint point = points[i];
        vec3 to = vpl.position - point.position;
        float q = min(dot(to, to) / max(near * near, 1e-30), 1.0);
        float light = dot(vpl_irradiance(vpl, point.position, point.normal, 0.0), vec3(0.2126, 0.7152, 0.0722)) * point.weight * q * q;
        if (light <= 0.0) continue;
        vec3 origin = point.position + point.normal * point.gap;
        Ray ray = Ray(origin, 0.0, vpl.position + vpl.normal * vpl.gap - origin, 0.99999);
        if (!trace_any(ray, TRACE_SHADOW, pcg4d(uvec4(at, i, seed, 0x1a97u)).x)) sum += light;
    }
    importances[at] += sum;
}
