// Adds the irradiance from a range of virtual lights to all cache cells.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#define TRACE_BOXES
#include "lib/random.glsl"
#include "lib/trace.glsl"
#include "lib/vpl.glsl"
#include "igi/cache.glsl"

layout(local_size_x = 64) in;

layout(binding = 3, scalar) readonly buffer Vpls { Vpl vpls[]; };

layout(push_constant, scalar) uniform Push {
    uint first;      // virtual light
    uint count;
    uint most;       // maximum of cells
    float least;     // min_d of the bounded geometry term, metres; 0: none
    uint seed;
};

void main() {
    uint at = gl_GlobalInvocationID.x;
    if (cache_count > most || at >= cache_count) return;
    uint slot = cache_list[at];
    CacheCell cell = cache_cells[slot];
    vec3 origin = cell.position + cell.normal * cell.gap;
    vec3 sum = vec3(0.0);
    for (uint k = first; k < first + count; ++k) {
        Vpl vpl = vpls[k];
        vec3 light = vpl_irradiance(vpl, cell.position, cell.normal, least);
        if (light == vec3(0.0)) continue;
        vec3 to = vpl.position + vpl.normal * vpl.gap - origin;
        uint salt = pcg4d(uvec4(cell.node, 0xcacu, k, seed)).x;
        if (!trace_any(Ray(origin, 0.0, to, 0.99999), TRACE_SHADOW, salt)) sum += light;
    }
    cache_cells[slot].light = cell.light + sum;
}
