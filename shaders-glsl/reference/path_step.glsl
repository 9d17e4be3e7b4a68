// The surface that the ray of a path has hit. Included by reference/path.comp, whose bindings it uses.

// A path goes on with the probability of its throughput times this number. The number of rays to an equal error is the least at 3 to 5 in rooms
// and in the open. At 1, which is common, rare paths are as bright as the picture and make noise.
const float ROULETTE_SCALE = 4.0;

// The members of PathState that a surface changes.
struct Path {
    vec3 origin;
    float density;
    vec3 direction;
    vec3 throughput;
    Steps steps;
};

void add_radiance(uint slot, uint scatterings, vec3 radiance) {
    if (scatterings == 0u) PATH_AT(slot).emission += radiance;
    else if (scatterings == 1u) PATH_AT(slot).direct += radiance;
    else PATH_AT(slot).indirect += radiance;
}

// Weight of the light that a scattered ray hits (multiple importance sampling). `density`: density with which light sampling would choose the
// same direction, per steradian.
float met_credit(Path path, float density) {
    if (path.density == 0.0 || (settings.flags & PATH_NO_LIGHT_SAMPLES) != 0u) return 1.0;
    if ((settings.flags & PATH_NO_BSDF_SAMPLES) != 0u) return 0.0;
    return power_heuristic(path.density, density);
}

// Samples a triangle that was chosen with probability `chosen`. Returns the density per steradian; 0: the triangle emits no light towards
// `from`. `target`: the position of `point`, moved a step off its surface, so that the triangle does not occlude itself.
float sample_triangle_light(float chosen, vec3 from, SurfacePoint point, bool double_sided, out vec3 target) {
    target = point.position;
    vec3 away = from - point.position;
    float distance2 = dot(away, away);
    float facing = dot(point.area, away);
    bool lit = facing > 0.0 || (double_sided && facing < 0.0);
    if (!lit || distance2 == 0.0) return 0.0;
    target += point.area * (sign(facing) * surface_gap(point) / length(point.area));
    return chosen * 2.0 * distance2 * sqrt(distance2) / abs(facing);
}

// Adds the light of the surface, samples lights and the next direction. Rays to lights wait in the state. Returns their kinds as bits.
uint path_surface(uvec2 pixel, uint number, uint slot, Hit hit, inout Path path) {
    uint dimension = path_dimension(path.steps.vertex);
    uvec4 salts = random_words(pixel, number, dimension, settings.seed);
    PointPlace points_at = point_place(pixel, number, settings.plan, settings.seed);
    vec3 toward = normalize(path.direction);
    bool missed = hit.instance == NONE;
    bool scatters = !missed && path.steps.scattered <= settings.bounces;

    // For each kind of light: its direction; unoccluded light over its density; density per steradian, 0 for a light without extent. There are no
    // arrays here, because compilers of CPU drivers access arrays at run-time indices for one invocation after the other.
    vec3 way_lamp = vec3(0.0), way_sun = vec3(0.0), way_sky = vec3(0.0);
    vec3 from_lamp = vec3(0.0), from_sun = vec3(0.0), from_sky = vec3(0.0);
    float density_lamp = 0.0, density_sky = 0.0;
    bool samples_extended = (settings.flags & PATH_NO_LIGHT_SAMPLES) == 0u;
    vec2 which = unit_floats(point_words(points_at, dimension + 1u, settings.seed));

    // An instance of NONE has no point.
    SurfacePoint point, lamp_point;
    vec4 color = vec4(1.0), lamp_color = vec4(1.0);
    uint material = NONE, lamp_material = NONE, lamp_instance = NONE;
    vec3 above = vec3(0.0);
    vec3 side = vec3(0.0);
    bool front = true;
    LightTarget to = LightTarget(NONE, 0u, 0u);
    float chosen = 0.0;
    if (!missed) {
        point = surface_point(hit.instance, hit.triangle, hit.barycentrics);
        color = surface_color(hit.instance, point);
        material = INSTANCE_AT(hit.instance).material;
        vec3 geometric = normalize(point.area);
        front = dot(geometric, toward) < 0.0;
        side = front ? geometric : -geometric;
        // The origin also steps back along the ray, where there is free space. At an edge between two surfaces rounding may place the hit
        // behind the other surface, whose back would occlude all light.
        above = point.position + (side - toward) * surface_gap(point);
        if (scatters && settings.tree != 0u) {
            to = LIGHT_TARGET(pick_light(above, side, which.x, salts.zw, chosen));
            if (to.instance != TARGET_PUNCTUAL) {
                lamp_instance = to.instance;
                lamp_point = surface_point(lamp_instance, to.index, sample_triangle(which));
                lamp_color = surface_color(lamp_instance, lamp_point);
                lamp_material = INSTANCE_AT(lamp_instance).material;
            }
        }
    }
    vec4 base_texel = vec4(1.0), metal_texel = vec4(1.0), normal_texel = vec4(1.0), emissive_texel = vec4(1.0), glass_texel = vec4(1.0);
    vec4 lamp_base_texel = vec4(1.0), lamp_emissive_texel = vec4(1.0);
    for (uint i = 0u; i < settings.textures; ++i) {
        bool of_lamp = settings.texture_slots[i] >= TEXTURE_OF_LAMP;
        uint slot_of = settings.texture_slots[i] % TEXTURE_OF_LAMP;
        uint m = of_lamp ? lamp_material : material;
        if (m == NONE || !has_texture(MATERIAL_AT(m).flags, slot_of)) continue;
        TextureUse use = MATERIAL_AT(m).textures[slot_of];
        SurfacePoint p = point;
        if (of_lamp) p = lamp_point;
        vec4 texel = sample_texture(use, surface_uv(of_lamp ? lamp_instance : hit.instance, p, use.uv_set), 0.0);
        if (of_lamp) {
            if (slot_of == TEXTURE_BASE_COLOR) lamp_base_texel = texel;
            else lamp_emissive_texel = texel;
        } else if (slot_of == TEXTURE_BASE_COLOR) {
            base_texel = texel;
        } else if (slot_of == TEXTURE_METALLIC_ROUGHNESS) {
            metal_texel = texel;
        } else if (slot_of == TEXTURE_NORMAL) {
            normal_texel = texel;
        } else if (slot_of == TEXTURE_EMISSIVE) {
            emissive_texel = texel;
        } else {
            glass_texel = texel;
        }
    }

    bool to_sky = scatters && samples_extended && (settings.flags & PATH_SEES_ENVIRONMENT) != 0u;
    if (to_sky) {
        way_sky = environment_sample(settings.environment, point_words(points_at, dimension + 2u, settings.seed), density_sky);
    }
    vec3 sky = vec3(0.0);
    if (missed || to_sky) sky = environment_radiance(settings.environment, missed ? toward : way_sky);
    if (missed) {
        path.steps.alive = false;
        if ((settings.flags & PATH_SEES_ENVIRONMENT) != 0u) {
            float density = environment_density(settings.environment, toward);
            add_radiance(slot, path.steps.scattered, path.throughput * sky * met_credit(path, density));
        }
        return 0u;
    }
    if (to_sky && density_sky > 0.0) from_sky = sky / density_sky;

    uint flags = MATERIAL_AT(material).flags;
    float twice_area = length(point.area);
    float gap = surface_gap(point);

    if (lamp_instance != NONE) {
        uint m = lamp_material;
        uint kind = MATERIAL_AT(m).flags;
        vec3 target;
        float density = sample_triangle_light(chosen, above, lamp_point, (kind & MATERIAL_DOUBLE_SIDED) != 0u, target);
        float alpha = MATERIAL_AT(m).base_color.a * lamp_base_texel.a * lamp_color.a;
        float covers = (kind & MATERIAL_MASK) != 0u ? float(alpha >= MATERIAL_AT(m).alpha_cutoff)
            : (kind & MATERIAL_BLEND) != 0u ? clamp(alpha, 0.0, 1.0) : 1.0;
        if (density > 0.0 && samples_extended) {
            from_lamp = MATERIAL_AT(m).emissive * lamp_emissive_texel.rgb * (covers / density);
            density_lamp = density;
            way_lamp = target - above;
        }
    }
    // A directional light, and the point or spot light from the light tree.
    for (uint turn_of = 1u; turn_of < settings.turns; ++turn_of) {
        uint i = settings.turn_ways[turn_of];
        uint chosen_light = to.index;
        float probability = chosen;
        if (!scatters || i == TO_SKY) continue;
        if (i == TO_SUN) {
            chosen_light = LIGHT_TARGET(pick_sun(settings.suns, salts.z, unit_float(salts.w), probability)).index;
        } else if (to.instance != TARGET_PUNCTUAL) {
            continue;
        }
        Light one = light(chosen_light);
        vec3 to_light;
        vec3 arrives = light_irradiance(one, above, to_light) / probability;
        if (i == TO_SUN) {
            from_sun = arrives;
            way_sun = to_light;
        } else {
            from_lamp = arrives;
            way_lamp = one.position - above;
        }
    }

    vec4 base = MATERIAL_AT(material).base_color * base_texel * color;
    vec3 normal = normalize(surface_normal(hit.instance, point));
    if (has_texture(flags, TEXTURE_NORMAL)) {
        vec4 tangent = surface_tangent(hit.instance, point);
        if (dot(tangent.xyz, tangent.xyz) > 0.0) {
            vec3 t = normalize(tangent.xyz);
            vec3 b = cross(normal, t) * tangent.w;
            vec3 mapped = (normal_texel.xyz * 2.0 - 1.0) * vec3(vec2(MATERIAL_AT(material).normal_scale), 1.0);
            normal = normalize(mat3(t, b, normal) * mapped);
        }
    }
    if (!front) normal = -normal;
    if (any(isnan(normal))) normal = side;
    bool unlit = (flags & MATERIAL_UNLIT) != 0u;
    float metallic = clamp(MATERIAL_AT(material).metallic * metal_texel.b, 0.0, 1.0);
    float roughness = clamp(MATERIAL_AT(material).roughness * metal_texel.g, 0.0, 1.0);
    float ior = MATERIAL_AT(material).ior;
    vec3 albedo = unlit ? vec3(0.0) : (1.0 - metallic) * base.rgb;
    if (path.steps.vertex == 0u) {
        PATH_AT(slot).albedo = albedo;
        PATH_AT(slot).depth = -(view.view_from_world * vec4(point.position, 1.0)).z;
        PATH_AT(slot).normal = normal;
        PATH_AT(slot).position = point.position;
    }

    if ((settings.flags & PATH_SEES_EMISSION) != 0u) {
        vec3 emitted = MATERIAL_AT(material).emissive * emissive_texel.rgb;
        if (unlit) {
            add_radiance(slot, path.steps.scattered, path.throughput * base.rgb);
        } else if (emitted != vec3(0.0) && (front || (flags & MATERIAL_DOUBLE_SIDED) != 0u)) {
            vec3 way = point.position - path.origin;
            float facing = abs(dot(side, toward)) * twice_area;
            float chance = path.density > 0.0 ? triangle_choice(hit.instance, hit.triangle, path.origin, PATH_AT(slot).side) : 0.0;
            float density = chance * 2.0 * dot(way, way) / facing;
            add_radiance(slot, path.steps.scattered, path.throughput * emitted * met_credit(path, density));
        }
    }
    path.steps.vertex += 1u;
    if (unlit) {
        path.steps.alive = false;
        return 0u;
    }

    bool diffuse_only = (settings.flags & PATH_DIFFUSE_ONLY) != 0u;
    bool mirror = !diffuse_only && roughness < 0.05 && metallic > 0.5;
    if (!diffuse_only && metallic > 0.5) normal = mirroring_normal(normal, side, -toward);
    float dielectric = (ior - 1.0) * (ior - 1.0) / ((ior + 1.0) * (ior + 1.0));
    float transmission = diffuse_only ? 0.0 : clamp(MATERIAL_AT(material).transmission * glass_texel.r, 0.0, 1.0);
    vec3 v = -toward;
    Bsdf b;
    b.normal = normal;
    b.geometric = side;
    b.brdf = brdf_of(albedo, diffuse_only ? vec3(0.0) : mix(vec3(dielectric), base.rgb, metallic), roughness, dot(normal, v));
    b.glossy_share = glossy_share(b.brdf);
    b.glass = transmission;
    b.mirror = mirror ? 1.0 - transmission : 0.0;
    b.rough = mirror ? 0.0 : 1.0 - transmission;
    b.tint = base.rgb;
    b.thin = (flags & MATERIAL_DOUBLE_SIDED) != 0u;
    b.eta = front || b.thin ? ior : 1.0 / ior;

    // Which lobes are sampled. After the last scattering a ray is useful only if it can hit an emissive surface or the environment.
    bool sees = (settings.flags & (PATH_SEES_EMISSION | PATH_SEES_ENVIRONMENT)) != 0u;
    float go_rough = scatters && (path.steps.scattered < settings.bounces || sees) ? b.rough : 0.0;
    float go_sharp = path.steps.specular < settings.specular_bounces ? b.glass + b.mirror : 0.0;
    float go = go_rough + go_sharp;

    // Evaluates the BSDF for the light samples and for the scattered ray in one loop, so that the code exists once.
    vec2 ahead = unit_floats(point_words(points_at, dimension + 3u, settings.seed));
    float pick = 0.0;
    if (b.glossy_share > 0.0 || go_sharp > 0.0) pick = unit_float(point_words(points_at, dimension + 4u, settings.seed).x) * go;
    bool on = go > 0.0 && pick < go_rough;
    // The remainder of the number chooses between the diffuse and the glossy lobe.
    vec3 onward = vec3(0.0);
    if (on) onward = bsdf_sample_rough(b, v, pick / go_rough, ahead);
    vec3 value_on = vec3(0.0);
    float density_on = 0.0;
    uint waiting = 0u;
    for (uint turn_of = 0u; turn_of < settings.turns; ++turn_of) {
        uint i = settings.turn_ways[turn_of];
        vec3 way = i == ON ? onward : i == TO_LIGHT ? way_lamp : i == TO_SUN ? way_sun : way_sky;
        vec3 arriving = i == TO_LIGHT ? from_lamp : i == TO_SUN ? from_sun : from_sky;
        float density_of_light = i == TO_LIGHT ? density_lamp : i == TO_SUN ? 0.0 : density_sky;
        bool to_lamp = i != ON;
        if (way == vec3(0.0) || (to_lamp && (arriving == vec3(0.0) || b.rough <= 0.0))) continue;
        float density;
        vec3 value = bsdf_rough(b, v, normalize(way), density);
        density = go > 0.0 ? density * (go_rough / go) : 0.0;
        if (!to_lamp) {
            value_on = value;
            density_on = density;
            continue;
        }
        vec3 arrives = value * arriving;
        if (arrives == vec3(0.0)) continue;
        if (density_of_light > 0.0 && (settings.flags & PATH_NO_BSDF_SAMPLES) == 0u) {
            arrives *= power_heuristic(density_of_light, density);
        }
        WaitingLight waits = WaitingLight(way, path.throughput * b.rough * arrives);
        if (i == TO_LIGHT) PATH_AT(slot).lamp = waits;
        else if (i == TO_SUN) PATH_AT(slot).sun = waits;
        else PATH_AT(slot).sky = waits;
        waiting |= 1u << i;
    }
    if (waiting != 0u) {
        PATH_AT(slot).light_origin = above;
        PATH_AT(slot).salt = salts.y;
        PATH_AT(slot).to_direct = uint(path.steps.scattered == 0u);
    }

    if (go <= 0.0) {
        path.steps.alive = false;
        return waiting;
    }
    if (on) {
        path.direction = onward;
        path.density = density_on;
        path.throughput *= path.density > 0.0 ? value_on * b.rough / path.density : vec3(0.0);
        path.origin = above;
        PATH_AT(slot).side = side;
        path.steps.scattered += 1u;
        if (path.throughput == vec3(0.0)) path.steps.alive = false;
        if (path.steps.scattered > settings.roulette) {
            float stay = min(ROULETTE_SCALE * brightest(path.throughput), 1.0);
            if (stay < 1.0) {
                if (unit_float(pcg4d(salts).x) >= stay) path.steps.alive = false;
                path.throughput /= max(stay, 1e-20);
            }
        }
        return waiting;
    }
    path.throughput *= go;
    // `go` is the share of the lobes that are sampled. The share of the other lobes is absorbed.
    path.density = 0.0;
    path.steps.specular += 1u;
    float cosine = clamp(dot(b.normal, v), 0.0, 1.0);
    if (pick - go_rough >= b.glass) {
        path.direction = reflect(toward, b.normal);
        path.throughput *= schlick(b.tint, cosine);
        path.origin = above;
    } else {
        float f = fresnel_dielectric(cosine, b.eta);
        if (b.thin) f = fresnel_sheet(f);
        if (ahead.x < f) {
            path.direction = reflect(toward, b.normal);
            path.origin = above;
        } else {
            path.throughput *= b.tint;
            path.direction = b.thin ? toward : refract(toward, b.normal, 1.0 / b.eta);
            path.origin = point.position - side * gap;
            // Refraction scales radiance with the square of the refractive index.
            if (!b.thin) path.throughput /= b.eta * b.eta;
        }
    }
    if (path.throughput == vec3(0.0) || path.direction == vec3(0.0)) path.steps.alive = false;
    return waiting;
}
