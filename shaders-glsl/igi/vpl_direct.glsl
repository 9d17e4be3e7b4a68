// Direct light by shadow rays: one ray to each point, spot and directional light, and samples of emissive surfaces and of the environment.
// And samples of the sky's highlights on smooth surfaces.
// Before including: lib/lights.glsl, lib/light_sampling.glsl, lib/sampling.glsl, lib/hit_surface.glsl, lib/vpl.glsl, igi/vpl_surface.glsl, lib/brdf.glsl;
// and `settings`.
#ifndef LIB_VPL_DIRECT
#define LIB_VPL_DIRECT
#include "lib/points.glsl"

// A receiver of direct light.
struct LitPoint {
    vec3 position; // metres
    vec3 above;    // the position, a step off the surface, metres
    vec3 normal;   // unit
    vec3 viewer;   // unit, towards the viewer
    Brdf brdf;     // for the viewer
};

// The material's BRDF; without its specular part if the settings switch it off.
Brdf lit_brdf(vec3 albedo, vec3 f0, float roughness, float nv) {
    return brdf_of(albedo, settings.diffuse_only != 0u ? vec3(0.0) : f0, roughness, nv);
}

// Number of a point's first shadow ray to highlights of the sky, after those to lights, to emissive surfaces and to the sky.
uint first_highlight() {
    return light_count + (settings.tree + settings.sky) * settings.samples;
}

// Number of shadow rays per point.
uint direct_rays() {
    return first_highlight() + settings.glossy;
}

// Largest GGX width for which highlights of the sky also have samples of their own. Samples of the sky find narrower ones by chance: few of them
// would be far brighter than all others.
const float NARROW_HIGHLIGHT = 0.3;

// Rays of this point for its highlights of the sky.
uint highlight_rays(Brdf brdf) {
    return brdf.f90 > 0.0 && brdf.alpha < NARROW_HIGHLIGHT ? settings.glossy : 0u;
}

// Density of the samples of the sky and of the highlights together at a unit direction, per steradian. `density`: that of the sky. Highlights
// are divided by it, wherever their sample is from (balance heuristic of Veach and Guibas 1995 for several samples of each kind).
float highlight_density(LitPoint p, vec3 direction, float density) {
    vec3 h = normalize(direction + p.viewer);
    float own = ggx_distribution(clamp(dot(p.normal, h), 0.0, 1.0), length(cross(p.normal, h)), p.brdf.alpha)
        * ggx_masking(p.brdf.nv, p.brdf.alpha) / (4.0 * p.brdf.nv);
    return float(settings.samples) * density + float(settings.glossy) * own;
}

// Sample j of the highlights of the sky, as direct_ray().
vec3 highlight_ray(uint j, LitPoint p, uvec2 place, inout Ray ray) {
    if (j >= highlight_rays(p.brdf)) return vec3(0.0);
    uint plan = uint(findMSB(settings.glossy - 1u) + 1);
    PointPlace points_at = point_place(place, j, plan, settings.seed ^ 0x9105u);
    mat3 frame = frame_around(p.normal);
    vec3 v = p.viewer * frame;
    v.z = max(v.z, 1e-4);
    v = normalize(v);
    vec3 h = sample_ggx_visible(unit_floats(point_words(points_at, 2u, settings.seed)), v, p.brdf.alpha);
    vec3 direction = frame * reflect(-v, h);
    if (dot(p.normal, direction) <= 0.0) return vec3(0.0);
    ray.direction = direction;
    ray.t_max = 1e30;
    float density = highlight_density(p, direction, environment_density(settings.environment, direction));
    vec3 light = environment_radiance(settings.environment, direction);
    return density > 0.0 ? light * brdf_specular_cosine(p.brdf, p.normal, p.viewer, direction) / density : vec3(0.0);
}

// Shadow ray number i. Returns the radiance (W/(sr·m²)) that the point reflects towards the viewer if the ray is not occluded.
vec3 direct_ray(uint i, LitPoint p, uvec2 place, out Ray ray) {
    ray = Ray(p.above, 0.0, vec3(0.0, 1.0, 0.0), 0.99999);
    if (i >= first_highlight()) return highlight_ray(i - first_highlight(), p, place, ray);
    vec3 arrives = vec3(0.0); // irradiance on a plane that faces the light
    vec3 highlight = vec3(0.0); // the part of `arrives` whose highlight other samples have
    vec3 to_light = p.normal;
    if (i < light_count) {
        Light one = light(i);
        arrives = light_irradiance(one, p.position, to_light);
        ray.direction = one.kind == LIGHT_DIRECTIONAL ? to_light : one.position - p.above;
        ray.t_max = one.kind == LIGHT_DIRECTIONAL ? 1e30 : 0.99999;
    } else {
        uint j = i - light_count;
        uint plan = uint(findMSB(settings.samples - 1u) + 1);
        PointPlace points_at = point_place(place, j % settings.samples, plan, settings.seed ^ 0xd12ecu);
        if (settings.tree != 0u && j < settings.samples) {
            float chosen;
            vec2 u = unit_floats(point_words(points_at, 0u, settings.seed));
            LightTarget to = LIGHT_TARGET(pick_light(p.above, p.normal, u.x, pcg4d(uvec4(place, settings.seed, i)).xy, chosen));
            SurfacePoint point = surface_point(to.instance, to.index, sample_triangle(u));
            bool both = (materials[surface_instances[to.instance].material].flags & MATERIAL_DOUBLE_SIDED) != 0u;
            vec3 away = p.position - point.position;
            float facing = dot(point.area, away);
            float d2 = dot(away, away);
            if ((facing > 0.0 || (both && facing < 0.0)) && d2 > 0.0 && chosen > 0.0) {
                // The length of `point.area` is twice the triangle's area.
                float angle = 0.5 * abs(facing) / (d2 * sqrt(d2));
                arrives = triangle_radiance(to.instance, point, settings.two) * (angle / (chosen * float(settings.samples)));
                vec3 target = point.position + point.area * (sign(facing) * surface_gap(point) / length(point.area));
                ray.direction = target - p.above;
                to_light = -away * inversesqrt(d2);
            }
        } else {
            float density;
            to_light = environment_sample(settings.environment, point_words(points_at, 1u, settings.seed), density);
            if (density > 0.0) {
                vec3 light = environment_radiance(settings.environment, to_light);
                arrives = light / (density * float(settings.samples));
                if (highlight_rays(p.brdf) > 0u) highlight = arrives - light / highlight_density(p, to_light, density);
            }
            ray.direction = to_light;
            ray.t_max = 1e30;
        }
    }
    float cosine = dot(p.normal, to_light);
    if (cosine <= 0.0 || arrives == vec3(0.0)) return vec3(0.0);
    vec3 light = arrives * brdf_cosine(p.brdf, p.normal, p.viewer, to_light);
    // The rest of the highlight comes from samples of its own.
    if (highlight != vec3(0.0)) light = max(light - highlight * brdf_specular_cosine(p.brdf, p.normal, p.viewer, to_light), vec3(0.0));
    return light;
}

#endif
