// What lights the ends of short paths: a sample of direct light.
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
#define ENVIRONMENT_COLUMNS_BINDING 9
#include "lib/environment_sampling.glsl"
#define LIGHT_COLUMNS_BINDING 10
#define LIGHT_TARGETS_BINDING 11
#define INSTANCE_LIGHTS_BINDING 12
#define LIGHT_NODES_BINDING 16
#include "lib/light_sampling.glsl"
#define SURFACE_BINDING 60
#include "lib/hit_surface.glsl"
#include "lib/trace.glsl"
#include "lib/igi.glsl"
#include "lib/vpl.glsl"
#include "lib/vpl_surface.glsl"
#include "lib/igi_near.glsl"

layout(local_size_x = 64) in;

layout(binding = 13, scalar) uniform SettingsBlock { IgiSettings settings; };

layout(push_constant, scalar) uniform Push {
    uint count;    // paths
    uint turn;     // segments before the one that led here
    uint number;
};

#include "lib/vpl_direct.glsl"

void main() {
    uint slot = gl_GlobalInvocationID.x;
    if (slot >= count || near_paths[slot].alive == 0u) return;
    NearPath path = near_paths[slot];
    vec3 above = path.position + path.side * path.gap;
    uvec4 words = pcg4d(uvec4(path.salt, number, turn, settings.seed ^ 0x11f0u));
    uint lamps = direct_rays();
    if (lamps == 0u) return;
    // Albedo π: radiance is irradiance.
    LitPoint p = LitPoint(path.position, above, path.normal, path.normal, vec3(0.0), LIT_MATT, vec3(BRDF_PI));
    Ray ray;
    vec3 light = direct_ray(pick_below(words.x, lamps), p, words.zw, ray) * float(lamps);
    if (light == vec3(0.0) || trace_any(ray, TRACE_SHADOW, words.y)) return;
    near_paths[slot].light = path.light + path.weight * light;
}
