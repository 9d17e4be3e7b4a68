// One ray of a path. Included by reference/path.comp, whose bindings it uses.

PathState camera_path(uvec2 pixel) {
    PathState path;
    vec2 inside = vec2(0.5);
    if ((settings.flags & PATH_JITTER) != 0u) {
        inside = unit_floats(random_words(pixel, sample_index, 0u, settings.seed).xy);
    }
    vec2 uv = (vec2(pixel) + inside) / vec2(settings.extent);
    // As the rasteriser clips: from the near to the far plane.
    float near = view.near / view.far;
    path.direction = view_ray(view, uv);
    path.origin = view_base(view, uv) + near * path.direction;
    path.limit = 1.0 - near;
    path.density = 0.0;
    path.throughput = vec3(1.0);
    path.alive = 1u;
    path.vertex = 0u;
    path.scattered = 0u;
    path.specular = 0u;
    path.emission = vec3(0.0);
    path.direct = vec3(0.0);
    path.indirect = vec3(0.0);
    path.waiting = 0u;
    return path;
}

void add_radiance(inout PathState path, uint scatterings, vec3 radiance) {
    if (scatterings == 0u) path.emission += radiance;
    else if (scatterings == 1u) path.direct += radiance;
    else path.indirect += radiance;
}

// Credit of light that a scattered ray has met by chance, where sampling the lights would have found it with `density`.
float met_credit(PathState path, float density) {
    if (path.density == 0.0 || (settings.flags & PATH_NO_LIGHT_SAMPLES) != 0u) return 1.0;
    if ((settings.flags & PATH_NO_BSDF_SAMPLES) != 0u) return 0.0;
    return power_heuristic(path.density, density);
}

// Where light may come from, chosen before the surface is known in full.
struct LightSample {
    vec3 target;     // place, or unit direction
    bool far;        // target is a direction
    vec3 radiance;   // arriving over probability or density; before visibility
    float density;   // per steradian; 0: of no extent
    uint material;   // of an emissive triangle, or NONE
    uint instance;
    SurfacePoint point;
};

LightSample sample_light(vec3 from, uvec4 which, uvec4 where) {
    LightSample s;
    s.far = false;
    s.radiance = vec3(0.0);
    s.density = 0.0;
    s.material = NONE;
    float chosen;
    LightTarget to = light_targets[pick_light(settings.lights, which.x, unit_float(which.y), chosen)];
    if (to.instance == TARGET_ENVIRONMENT) {
        s.far = true;
        s.target = environment_sample(settings.environment, which.z, unit_float(which.w), unit_floats(where.xy), s.density);
        s.density *= chosen;
        if (s.density > 0.0) s.radiance = environment_radiance(settings.environment, s.target) / s.density;
    } else if (to.instance == TARGET_PUNCTUAL) {
        Light one = light(to.index);
        vec3 to_light;
        s.radiance = light_irradiance(one, from, to_light) / chosen;
        s.far = one.kind == LIGHT_DIRECTIONAL;
        s.target = s.far ? to_light : one.position;
    } else {
        s.instance = to.instance;
        s.point = surface_point(to.instance, to.index, sample_triangle(unit_floats(where.xy)));
        vec3 away = from - s.point.position;
        float distance2 = dot(away, away);
        float twice_area = length(s.point.area);
        float facing = dot(s.point.area, away);
        uint material = surface_instances[to.instance].material;
        bool lit = facing > 0.0 || (materials[material].flags & MATERIAL_DOUBLE_SIDED) != 0u;
        if (lit && facing != 0.0 && distance2 > 0.0) {
            s.material = material;
            s.density = chosen * 2.0 * distance2 * sqrt(distance2) / abs(facing);
            // A step towards the viewer: the triangle does not hide itself.
            s.target = s.point.position + s.point.area * (sign(facing) * surface_gap(s.point) / twice_area);
        }
    }
    return s;
}

// Either a light that waits for it, or the next surface: one place where rays are traced, so that their code exists once.
void path_step(uvec2 pixel, inout PathState path) {
    uint dimension = 1u + 4u * path.vertex;
    uvec4 salts = random_words(pixel, sample_index, dimension, settings.seed);
    bool to_light = path.waiting != 0u;
    Ray ray = Ray(path.origin, 0.0, path.direction, path.limit);
    uint mask = path.vertex == 0u ? TRACE_CAMERA : path.scattered > 0u ? TRACE_SHADOW : 0u;
    if (to_light) {
        ray = Ray(path.light_origin, 0.0, path.light_direction, path.light_limit);
        mask = TRACE_SHADOW;
    }
    Hit hit = trace(ray, mask, to_light ? path.salt : salts.x, to_light);
    if (to_light) {
        path.waiting = 0u;
        if (hit.instance == NONE) add_radiance(path, path.light_scatterings, path.light);
        return;
    }
    vec3 toward = normalize(path.direction);
    if (hit.instance == NONE) {
        path.alive = 0u;
        if ((settings.flags & PATH_SEES_ENVIRONMENT) != 0u) {
            float density = settings.environment_choice * environment_density(settings.environment, toward);
            vec3 radiance = environment_radiance(settings.environment, toward);
            add_radiance(path, path.scattered, path.throughput * radiance * met_credit(path, density));
        }
        return;
    }
    SurfacePoint point = surface_point(hit.instance, hit.triangle, hit.barycentrics);
    uint material = surface_instances[hit.instance].material;
    uint flags = materials[material].flags;
    float twice_area = length(point.area);
    vec3 geometric = point.area / twice_area;
    bool front = dot(geometric, toward) < 0.0;

    // All textures in one loop, so that their code exists once: those of the surface, then those of the light's triangle.
    bool scatters = path.scattered <= settings.bounces;
    float gap = surface_gap(point);
    vec3 side = front ? geometric : -geometric;
    vec3 above = point.position + side * gap;
    LightSample sample_of;
    sample_of.material = NONE;
    sample_of.radiance = vec3(0.0);
    if (scatters && settings.lights > 0u) {
        uvec4 which = random_words(pixel, sample_index, dimension + 1u, settings.seed);
        uvec4 where = random_words(pixel, sample_index, dimension + 2u, settings.seed);
        sample_of = sample_light(above, which, where);
    }
    vec4 texels[TEXTURE_SLOTS + 2u];
    for (uint i = 0u; i < settings.slots; ++i) {
        bool of_light = i >= TEXTURE_SLOTS;
        uint slot = of_light ? (i == TEXTURE_SLOTS ? TEXTURE_BASE_COLOR : TEXTURE_EMISSIVE) : i;
        uint which = of_light ? sample_of.material : material;
        texels[i] = vec4(1.0);
        if (which == NONE || !has_texture(materials[which].flags, slot)) continue;
        TextureUse use = materials[which].textures[slot];
        vec2 uv;
        if (of_light) uv = surface_uv(sample_of.instance, sample_of.point, use.uv_set);
        else uv = surface_uv(hit.instance, point, use.uv_set);
        texels[i] = sample_texture(use, uv, 0.0);
    }

    vec4 base = materials[material].base_color * texels[TEXTURE_BASE_COLOR] * surface_color(hit.instance, point);
    vec3 normal = normalize(surface_normal(hit.instance, point));
    if (has_texture(flags, TEXTURE_NORMAL)) {
        vec4 tangent = surface_tangent(hit.instance, point);
        if (dot(tangent.xyz, tangent.xyz) > 0.0) {
            vec3 t = normalize(tangent.xyz);
            vec3 b = cross(normal, t) * tangent.w;
            vec3 mapped = (texels[TEXTURE_NORMAL].xyz * 2.0 - 1.0) * vec3(vec2(materials[material].normal_scale), 1.0);
            normal = normalize(mat3(t, b, normal) * mapped);
        }
    }
    if (!front) normal = -normal;
    if (any(isnan(normal))) normal = side;
    bool unlit = (flags & MATERIAL_UNLIT) != 0u;
    float metallic = clamp(materials[material].metallic * texels[TEXTURE_METALLIC_ROUGHNESS].b, 0.0, 1.0);
    float roughness = clamp(materials[material].roughness * texels[TEXTURE_METALLIC_ROUGHNESS].g, 0.0, 1.0);
    float ior = materials[material].ior;
    vec3 albedo = unlit ? vec3(0.0) : (1.0 - metallic) * base.rgb;
    if (path.vertex == 0u) {
        float depth = -(view.view_from_world * vec4(point.position, 1.0)).z;
        add_surface(pixel, albedo, normal, point.position, depth);
    }

    if ((settings.flags & PATH_SEES_EMISSION) != 0u) {
        vec3 emitted = materials[material].emissive * texels[TEXTURE_EMISSIVE].rgb;
        if (unlit) {
            add_radiance(path, path.scattered, path.throughput * base.rgb);
        } else if (emitted != vec3(0.0) && (front || (flags & MATERIAL_DOUBLE_SIDED) != 0u)) {
            vec3 way = point.position - path.origin;
            float facing = abs(dot(geometric, toward)) * twice_area;
            float density = triangle_choice(hit.instance, hit.triangle) * 2.0 * dot(way, way) / facing;
            add_radiance(path, path.scattered, path.throughput * emitted * met_credit(path, density));
        }
    }
    path.vertex += 1u;
    if (unlit) {
        path.alive = 0u;
        return;
    }

    bool diffuse_only = (settings.flags & PATH_DIFFUSE_ONLY) != 0u;
    bool mirror = !diffuse_only && roughness < 0.05 && metallic > 0.5;
    float dielectric = (ior - 1.0) * (ior - 1.0) / ((ior + 1.0) * (ior + 1.0));
    float transmission = diffuse_only ? 0.0 : clamp(materials[material].transmission * texels[TEXTURE_TRANSMISSION].r, 0.0, 1.0);
    vec3 v = -toward;
    Bsdf b;
    b.normal = normal;
    b.geometric = side;
    b.albedo = albedo;
    b.f0 = mix(vec3(dielectric), base.rgb, metallic);
    b.alpha = ggx_alpha(roughness);
    b.glossy_share = diffuse_only ? 0.0 : glossy_share(b.albedo, b.f0, max(dot(normal, v), 1e-4));
    b.glass = transmission;
    b.mirror = mirror ? 1.0 - transmission : 0.0;
    b.rough = mirror ? 0.0 : 1.0 - transmission;
    b.tint = base.rgb;
    b.thin = (flags & MATERIAL_DOUBLE_SIDED) != 0u;
    b.eta = front || b.thin ? ior : 1.0 / ior;

    // Which ways on are worth going: after the last scattering only light that stands in the way counts.
    bool sees = (settings.flags & (PATH_SEES_EMISSION | PATH_SEES_ENVIRONMENT)) != 0u;
    float go_rough = scatters && (path.scattered < settings.bounces || sees) ? b.rough : 0.0;
    float go_sharp = path.specular < settings.specular_bounces ? b.glass + b.mirror : 0.0;
    float go = go_rough + go_sharp;

    // Light from a light.
    if (scatters && b.rough > 0.0 && settings.lights > 0u) {
        bool wanted = sample_of.density == 0.0 || (settings.flags & PATH_NO_LIGHT_SAMPLES) == 0u;
        if (sample_of.material != NONE) {
            uint m = sample_of.material;
            float alpha = materials[m].base_color.a * texels[TEXTURE_SLOTS].a * surface_color(sample_of.instance, sample_of.point).a;
            uint kind = materials[m].flags;
            float covers = (kind & MATERIAL_MASK) != 0u ? float(alpha >= materials[m].alpha_cutoff)
                : (kind & MATERIAL_BLEND) != 0u ? clamp(alpha, 0.0, 1.0) : 1.0;
            sample_of.radiance = materials[m].emissive * texels[TEXTURE_SLOTS + 1u].rgb * (covers / sample_of.density);
        }
        if (wanted && sample_of.radiance != vec3(0.0)) {
            vec3 to = sample_of.far ? sample_of.target : sample_of.target - above;
            float density;
            vec3 value = bsdf_rough(b, v, normalize(to), density) * sample_of.radiance;
            if (sample_of.density > 0.0 && (settings.flags & PATH_NO_BSDF_SAMPLES) == 0u) {
                density *= go > 0.0 ? go_rough / go : 0.0;
                value *= power_heuristic(sample_of.density, density);
            }
            if (value != vec3(0.0)) {
                // A lamp or a triangle itself must not be in the way.
                float until = sample_of.far ? 1e30 : 0.99999;
                path.waiting = 1u;
                path.salt = salts.y;
                path.light_origin = above;
                path.light_limit = until;
                path.light_direction = to;
                path.light_scatterings = path.scattered + 1u;
                path.light = path.throughput * b.rough * value;
            }
        }
    }

    if (go <= 0.0) {
        path.alive = 0u;
        return;
    }
    uvec4 ahead = random_words(pixel, sample_index, dimension + 3u, settings.seed);
    path.limit = 1e30;
    float pick = unit_float(ahead.x) * go;
    if (pick < go_rough) {
        // The rest of the number chooses between the lobes.
        float share = go_rough / go;
        path.direction = bsdf_sample_rough(b, v, pick / go_rough, unit_floats(ahead.yz));
        float density;
        vec3 value = bsdf_rough(b, v, path.direction, density);
        path.density = density * share;
        path.throughput *= path.density > 0.0 ? value * b.rough / path.density : vec3(0.0);
        path.origin = above;
        path.scattered += 1u;
        if (path.throughput == vec3(0.0)) path.alive = 0u;
        if (path.scattered > settings.roulette) {
            float stay = min(brightest(path.throughput), 0.95);
            if (unit_float(ahead.w) >= stay) path.alive = 0u;
            path.throughput /= max(stay, 1e-20);
        }
        return;
    }
    path.throughput *= go;
    // The weights of what goes on sum to `go`; the share of what is left out is lost, not handed to the others.
    path.density = 0.0;
    path.specular += 1u;
    float cosine = clamp(dot(b.normal, v), 0.0, 1.0);
    if (pick - go_rough >= b.glass) {
        path.direction = reflect(toward, b.normal);
        path.throughput *= schlick(b.tint, cosine);
        path.origin = above;
    } else {
        float f = fresnel_dielectric(cosine, b.eta);
        if (b.thin) f = fresnel_sheet(f);
        if (unit_float(ahead.y) < f) {
            path.direction = reflect(toward, b.normal);
            path.origin = above;
        } else {
            path.throughput *= b.tint;
            path.direction = b.thin ? toward : refract(toward, b.normal, 1.0 / b.eta);
            path.origin = point.position - side * gap;
            // Radiance is denser where the refractive index is higher.
            if (!b.thin) path.throughput /= b.eta * b.eta;
        }
    }
    if (path.throughput == vec3(0.0) || path.direction == vec3(0.0)) path.alive = 0u;
}
