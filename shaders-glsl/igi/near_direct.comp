// Adds direct light at the ends of short paths, with one shadow ray for each path.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/scene.glsl"
#include "lib/random.glsl"
#include "lib/material.glsl"
#include "lib/lights.glsl"
#include "lib/sampling.glsl"
#include "lib/brdf.glsl"
#define ENVIRONMENT_BINDING 8
#define ENVIRONMENT_EDGES_BINDING 9
#include "lib/environment_sampling.glsl"
#define LIGHT_COLUMNS_BINDING 10
#define LIGHT_TARGETS_BINDING 11
#define INSTANCE_LIGHTS_BINDING 12
#define LIGHT_NODES_BINDING 16
#include "lib/light_sampling.glsl"
#define SURFACE_BINDING 60
#include "lib/hit_surface.glsl"
#include "lib/trace.glsl"
#include "igi/igi.glsl"
#include "lib/vpl.glsl"
#include "igi/vpl_surface.glsl"
#include "igi/near.glsl"

layout(local_size_x = 64) in;

layout(binding = 13, scalar) uniform SettingsBlock { IgiSettings settings; };

layout(push_constant, scalar) uniform Push {
    uint count;    // paths
    uint turn;     // index of the segment that led to the surface
    uint number;   // which path of the receiver
};

#include "igi/vpl_direct.glsl"

// Maximum of punctual lights that are evaluated. With more lights, this many are chosen at random.
const uint MOST_LAMPS = 16u;

void main() {
    uint slot = gl_GlobalInvocationID.x;
    if (slot >= count || near_paths[slot].alive == 0u) return;
    NearPath path = near_paths[slot];
    vec3 above = path.position + path.side * path.gap;
    uvec4 words = pcg4d(uvec4(path.salt, number, turn, settings.seed ^ 0x11f0u));
    // With albedo π the reflected radiance equals the irradiance.
    LitPoint p = LitPoint(path.position, above, path.normal, path.normal, lit_brdf(vec3(BRDF_PI), vec3(0.0), 1.0, 1.0));
    // Each light source proposes a sample. One sample is drawn in proportion to its unoccluded light, and only this one traces a shadow ray
    // (Talbot, Cline and Egbert, Importance Resampling for Global Illumination, 2005).
    Ray ray;
    vec3 light = vec3(0.0);
    float strength = 0.0, strengths = 0.0;
    uint lamps = min(light_count, MOST_LAMPS);
    for (uint k = 0u; k < lamps + settings.tree + settings.sky; ++k) {
        uvec4 more = pcg4d(uvec4(words.x, words.y, k, 0x1a3bu));
        uint i = k;
        float factor = 1.0;
        if (k >= lamps) {
            i = light_count + (k - lamps) * settings.samples + pick_below(more.x, settings.samples);
            factor = float(settings.samples);
        } else if (lamps < light_count) {
            i = pick_below(more.x, light_count);
            factor = float(light_count) / float(lamps);
        }
        Ray way;
        vec3 sent = direct_ray(i, p, words.zw, way) * factor;
        float weight = dot(sent, vec3(1.0));
        if (weight <= 0.0) continue;
        strengths += weight;
        if (unit_float(more.y) * strengths >= weight) continue;
        ray = way;
        light = sent;
        strength = weight;
    }
    if (strength <= 0.0 || trace_any(ray, TRACE_SHADOW, words.y)) return;
    near_paths[slot].light = path.light + path.weight * light * (strengths / strength);
}
