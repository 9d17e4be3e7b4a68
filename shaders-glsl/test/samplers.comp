// One sample of a distribution an invocation, with what it says its density is, for tests of lib/*sampling.glsl.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/scene.glsl"
#include "lib/random.glsl"
#include "lib/sampling.glsl"
#include "lib/bsdf.glsl"
#define ENVIRONMENT_BINDING 0
#define ENVIRONMENT_EDGES_BINDING 1
#include "lib/environment_sampling.glsl"
#define LIGHT_COLUMNS_BINDING 2
#define LIGHT_TARGETS_BINDING 3
#define INSTANCE_LIGHTS_BINDING 4
#define LIGHT_NODES_BINDING 8
#include "lib/light_sampling.glsl"
#include "reference/path.glsl"
#include "test/sampler_names.glsl"

layout(local_size_x = 64) in;

layout(binding = 5, scalar) uniform SettingsBlock { PathSettings settings; };
layout(binding = 6, scalar) writeonly buffer Drawn { vec4 drawn[]; };
// Reflected value times cosine, and a density looked up for a direction.
layout(binding = 7, scalar) writeonly buffer Values { vec4 values[]; };

layout(push_constant, scalar) uniform Push {
    uint which;   // SAMPLER_
    uint count;
    vec3 view;    // unit, towards the viewer
    float alpha;  // of GGX; cosine of a cone
    vec3 albedo;
    float share;  // of the GGX lobe
    vec3 f0;
};

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    uvec4 words = random_words(uvec2(i % 4096u, i / 4096u), 0u, which, settings.seed);
    vec2 u = unit_floats(words.xy);
    vec4 found = vec4(0.0);
    vec4 value = vec4(0.0);
    if (which == SAMPLER_DISC) found = vec4(sample_disc(u), 0.0, 1.0 / SAMPLING_PI);
    if (which == SAMPLER_COSINE) {
        found.xyz = sample_cosine(u);
        found.w = found.z / SAMPLING_PI;
    }
    if (which == SAMPLER_CONE) found = vec4(sample_cone(u, alpha), cone_density(alpha));
    if (which == SAMPLER_SPHERE) found = vec4(sample_sphere(u), 0.25 / SAMPLING_PI);
    if (which == SAMPLER_TRIANGLE) found = vec4(sample_triangle(u), 0.0, 2.0);
    if (which == SAMPLER_GGX) {
        vec3 h = sample_ggx_visible(u, view, alpha);
        found = vec4(reflect(-view, h), ggx_reflected_density(h, view, alpha));
    }
    if (which == SAMPLER_BSDF) {
        Bsdf b;
        b.normal = vec3(0.0, 0.0, 1.0);
        b.geometric = b.normal;
        b.brdf = brdf_of(albedo, f0, sqrt(alpha), view.z);
        b.glossy_share = share;
        found.xyz = bsdf_sample_rough(b, view, unit_float(words.z), u);
        value.xyz = bsdf_rough(b, view, found.xyz, found.w);
        float back;
        b.brdf = brdf_of(albedo, f0, sqrt(alpha), found.z);
        value.w = bsdf_rough(b, found.xyz, view, back).g;
    }
    if (which == SAMPLER_ENVIRONMENT) {
        found.xyz = environment_sample(settings.environment, words.zw, found.w);
        value = vec4(environment_radiance(settings.environment, found.xyz), environment_density(settings.environment, found.xyz));
    }
    if (which == SAMPLER_SUN) found.x = float(pick_sun(settings.suns, words.x, unit_float(words.y), found.w));
    if (which == SAMPLER_LIGHT) {
        // At `albedo`, for a surface that looks along `view`.
        uint number = pick_light(albedo, view, u.x, words.zw, found.w);
        found.x = float(number);
        // Independent of the choice.
        found.y = u.x;
        value.x = light_choice(number, albedo, view);
        // Of every light in turn, whichever is drawn.
        uint other = i % max(settings.textures, 1u);
        value.y = float(other);
        value.z = light_choice(other, albedo, view);
    }
    if (which == SAMPLER_NUMBERS) {
        found = vec4(unit_float(words.x), unit_float(words.y), unit_float(words.z), unit_float(words.w));
        value = vec4(float(pick_below(words.x, 1000u)), 0.0, 0.0, 0.0);
    }
    drawn[i] = found;
    values[i] = value;
}
