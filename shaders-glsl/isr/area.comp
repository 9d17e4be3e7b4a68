// Light of the sky and of emissive triangles by rays, for each texel of the coarse buffers.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/screen.glsl"
#include "lib/gbuffer.glsl"
#include "lib/scene.glsl"
#include "lib/random.glsl"
#include "lib/material.glsl"
#include "lib/sampling.glsl"
#include "lib/points.glsl"
#define ENVIRONMENT_BINDING 8
#define ENVIRONMENT_EDGES_BINDING 9
#include "lib/environment_sampling.glsl"
#define LIGHT_COLUMNS_BINDING 10
#define LIGHT_TARGETS_BINDING 11
#define INSTANCE_LIGHTS_BINDING 12
#define LIGHT_NODES_BINDING 13
#include "lib/light_sampling.glsl"
#define SURFACE_BINDING 60
#include "lib/hit_surface.glsl"
#include "lib/trace.glsl"
#include "lib/vpl.glsl"
#include "lib/emission.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// 1: the scene has an environment, or emissive triangles. Constants, so that compilers remove the code that a scene does not need.
layout(constant_id = 0) const uint SKY = 1;
layout(constant_id = 1) const uint TREE = 1;

struct IsrAreaSettings {
    EnvironmentMap environment;
    uint seed;
    uint rays;  // to the sky, and as many to emissive triangles; at least 2
    uint two;   // 2; compilers of CPU drivers would unroll a loop with a constant bound
};

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1) uniform sampler2D normal;        // full resolution
layout(binding = 2) uniform sampler2D depth;
layout(binding = 3) uniform sampler2D coarse_depth;
layout(binding = 4, scalar) uniform SettingsBlock { IsrAreaSettings settings; };
layout(binding = 5, scalar) readonly buffer Ambient { vec3 ambient[]; };
// rgb: share of the sky's irradiance that arrives, times a; a: the rays' estimate of the sky's irradiance without shadows, over the irradiance.
// A filter that averages all four and divides afterwards averages shadowed and unshadowed light apart.
layout(binding = 6, rgba16f) uniform writeonly image2D sky;
// rgb: radiance of a white receiver by the emissive triangles, W/(sr·m²); a: share of the hemisphere in which rays meet no surface.
layout(binding = 7, rgba16f) uniform writeonly image2D lamps;

#include "lib/ambient.glsl"

float luminance(vec3 c) {
    return dot(c, vec3(0.2126, 0.7152, 0.0722));
}

// The pixel of the texel's surface: that whose depth is nearest to the texel's.
ivec2 pixel_of(ivec2 texel, float z) {
    ivec2 size = textureSize(depth, 0), coarse = textureSize(coarse_depth, 0);
    int factor = (size.x + coarse.x - 1) / coarse.x;
    ivec2 found = min(texel * factor, size - 1);
    float least = 1e30;
    for (int i = 0; i < factor * factor; ++i) {
        ivec2 at = min(texel * factor + ivec2(i % factor, i / factor), size - 1);
        float off = abs(texelFetch(depth, at, 0).r - z);
        if (off < least) {
            least = off;
            found = at;
        }
    }
    return found;
}

// A point from which rays leave.
struct Place {
    vec3 position; // metres
    vec3 above;    // the position, a step off the surface, metres
    vec3 normal;   // unit
    uvec2 texel;
};

// A ray to the sky, and the irradiance (W/m²) that it stands for without shadows. Half of the rays go where the sky is bright and half where the
// surface looks; the balance heuristic joins both.
vec3 to_sky(uint i, PointPlace point, Place from, inout Ray ray) {
    uvec2 words = point_words(point, i & 1u, settings.seed);
    float by_sky;
    if (SKY != 0 && (i & 1u) == 0u) {
        ray.direction = environment_sample(settings.environment, words, by_sky);
    } else {
        ray.direction = frame_around(from.normal) * sample_cosine(unit_floats(words));
        by_sky = SKY != 0 ? environment_density(settings.environment, ray.direction) : 0.0;
    }
    ray.t_max = 1e30;
    float cosine = dot(from.normal, ray.direction);
    if (cosine <= 0.0) return vec3(0.0);
    float to_sky = float((settings.rays + 1u) / 2u), to_front = float(settings.rays / 2u);
    float density = to_sky * by_sky + to_front * cosine / SAMPLING_PI;
    return SKY != 0 ? environment_radiance(settings.environment, ray.direction) * (cosine / density) : vec3(0.0);
}

// The same for a point of an emissive triangle.
vec3 to_lamp(uint i, PointPlace point, Place from, inout Ray ray) {
    vec2 u = unit_floats(point_words(point, 2u, settings.seed));
    float chosen;
    LightTarget to = LIGHT_TARGET(pick_light(from.above, from.normal, u.x, pcg4d(uvec4(from.texel, i, settings.seed)).xy, chosen));
    SurfacePoint lamp = surface_point(to.instance, to.index, sample_triangle(u));
    bool both = (materials[surface_instances[to.instance].material].flags & MATERIAL_DOUBLE_SIDED) != 0u;
    vec3 away = from.position - lamp.position;
    float facing = dot(lamp.area, away);
    float d2 = dot(away, away);
    float cosine = -dot(from.normal, away);
    if (!(facing > 0.0 || (both && facing < 0.0)) || cosine <= 0.0 || d2 <= 0.0 || chosen <= 0.0) return vec3(0.0);
    vec3 target = lamp.position + lamp.area * (sign(facing) * surface_gap(lamp) / length(lamp.area));
    ray.direction = target - from.above;
    ray.t_max = 0.99999;
    // The length of `area` is twice the triangle's area; `away` is not of unit length.
    float form = 0.5 * abs(facing) * cosine / (d2 * d2);
    return triangle_radiance(to.instance, lamp, settings.two) * (form / (chosen * float(settings.rays)));
}

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(texel, imageSize(sky)))) return;
    float coarse = texelFetch(coarse_depth, texel, 0).r;
    vec3 open = vec3(0.0), arrives = vec3(0.0), from_lamps = vec3(0.0);
    float weight = 0.0, free = 0.0;
    if (coarse < 1.0) {
        ivec2 pixel = pixel_of(texel, coarse);
        float z = texelFetch(depth, pixel, 0).r;
        Place from;
        from.texel = uvec2(texel);
        from.normal = decode_normal(texelFetch(normal, pixel, 0));
        from.position = screen_position(view, pixel, 1.0, z);
        float gap = surface_step(view, from.position, z);
        from.above = stepped_back(view, from.position, gap) + from.normal * gap;
        uint plan = uint(findMSB(settings.rays - 1u) + 1);
        // Both kinds in one loop: the code that traces a ray is large, and compilers of CPU drivers need long for each copy.
        uint end = TREE != 0 ? 2u * settings.rays : settings.rays;
        for (uint i = 0u; i < end; ++i) {
            bool is_sky = TREE == 0 || i < settings.rays;
            PointPlace point = point_place(from.texel, i % settings.rays, plan, settings.seed ^ (is_sky ? 0x5c1eu : 0x1a3bu));
            Ray ray = Ray(from.above, 0.0, vec3(0.0, 1.0, 0.0), 1e30);
            vec3 light = is_sky ? to_sky(i, point, from, ray) : to_lamp(i, point, from, ray);
            // Rays to where the surface looks tell the share of the hemisphere without surfaces, too.
            bool counts = is_sky && (i & 1u) == 1u;
            if (!(luminance(light) > 0.0) && !counts) continue;
            if (is_sky) open += light;
            if (trace_any(ray, TRACE_SHADOW, pcg4d(uvec4(texel, i, settings.seed)).z)) continue;
            if (counts) free += 1.0;
            if (is_sky) arrives += light;
            else from_lamps += light;
        }
        float whole = luminance(ambient_irradiance(from.normal));
        weight = whole > 0.0 ? min(luminance(open) / whole, 1e4) : 0.0;
    }
    imageStore(sky, texel, vec4(arrives / max(open, vec3(1e-30)) * weight, weight));
    imageStore(lamps, texel, vec4(from_lamps / SAMPLING_PI, free / float(settings.rays / 2u)));
}
