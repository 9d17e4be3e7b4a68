// The surface that the ray of a path has hit. Included by reference/path.comp, whose bindings it uses.

void add_radiance(inout PathState path, uint scatterings, vec3 radiance) {
    if (scatterings == 0u) path.emission += radiance;
    else if (scatterings == 1u) path.direct += radiance;
    else path.indirect += radiance;
}

// Weight of the light that a scattered ray hits (multiple importance sampling). `density`: density with which light sampling would choose the
// same direction, per steradian.
float met_credit(PathState path, float density) {
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

// Adds the light of the surface, samples lights and the next direction. Rays to lights wait in the state.
void path_surface(uvec2 pixel, Hit hit, inout PathState path) {
    uint dimension = path_dimension(path);
    uvec4 salts = random_words(pixel, sample_index, dimension, settings.seed);
    vec3 toward = normalize(path.direction);
    bool missed = hit.instance == NONE;
    bool scatters = !missed && path.scattered <= settings.bounces;

    // Unoccluded light over its density, for each kind of light.
    vec3 arriving[3] = vec3[3](vec3(0.0), vec3(0.0), vec3(0.0));
    // Density per steradian; 0: a light without extent.
    float light_densities[3] = float[3](0.0, 0.0, 0.0);
    vec3 ways[4] = vec3[4](vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));
    bool samples_extended = (settings.flags & PATH_NO_LIGHT_SAMPLES) == 0u;
    uvec4 which = random_words(pixel, sample_index, dimension + 1u, settings.seed);
    uvec4 where = random_words(pixel, sample_index, dimension + 2u, settings.seed);

    // Evaluates the surface and the triangle of a light in one loop, so that the code exists once.
    LightTarget to = LightTarget(NONE, 0u, 0u);
    float chosen = 0.0;
    uint instances[2] = uint[2](hit.instance, NONE);
    uint triangles[2] = uint[2](hit.triangle, 0u);
    vec2 places[2] = vec2[2](hit.barycentrics, sample_triangle(unit_floats(where.xy)));
    uint surfaces[2] = uint[2](NONE, NONE);
    SurfacePoint points[2];
    vec4 colors[2];
    vec3 above = vec3(0.0);
    vec3 side = vec3(0.0);
    bool front = true;
    for (uint i = 0u; i < settings.two; ++i) {
        if (i == 1u && scatters && settings.tree != 0u) {
            to = light_targets[pick_light(above, side, which.xy, chosen)];
            if (to.instance != TARGET_PUNCTUAL) {
                instances[1] = to.instance;
                triangles[1] = to.index;
            }
        }
        if (instances[i] == NONE) continue;
        points[i] = surface_point(instances[i], triangles[i], places[i]);
        colors[i] = surface_color(instances[i], points[i]);
        surfaces[i] = INSTANCE_AT(instances[i]).material;
        if (i == 0u) {
            vec3 geometric = normalize(points[0].area);
            front = dot(geometric, toward) < 0.0;
            side = front ? geometric : -geometric;
            // The origin also steps back along the ray, where there is free space. At an edge between two surfaces rounding may place the hit
            // behind the other surface, whose back would occlude all light.
            above = points[0].position + (side - toward) * surface_gap(points[0]);
        }
    }
    vec4 texels[TEXTURE_SLOTS + 2u];
    for (uint i = 0u; i < settings.slots; ++i) {
        uint k = i / TEXTURE_SLOTS;
        uint slot = k == 0u ? i : i == TEXTURE_SLOTS ? TEXTURE_BASE_COLOR : TEXTURE_EMISSIVE;
        texels[i] = vec4(1.0);
        if (surfaces[k] == NONE || !has_texture(MATERIAL_AT(surfaces[k]).flags, slot)) continue;
        TextureUse use = MATERIAL_AT(surfaces[k]).textures[slot];
        texels[i] = sample_texture(use, surface_uv(instances[k], points[k], use.uv_set), 0.0);
    }

    bool to_sky = scatters && samples_extended && (settings.flags & PATH_SEES_ENVIRONMENT) != 0u;
    if (to_sky) {
        ways[TO_SKY] = environment_sample(settings.environment, which.z, unit_float(which.w), unit_floats(where.zw), light_densities[TO_SKY]);
    }
    vec3 sky = vec3(0.0);
    if (missed || to_sky) sky = environment_radiance(settings.environment, missed ? toward : ways[TO_SKY]);
    if (missed) {
        path.alive = 0u;
        if ((settings.flags & PATH_SEES_ENVIRONMENT) != 0u) {
            float density = environment_density(settings.environment, toward);
            add_radiance(path, path.scattered, path.throughput * sky * met_credit(path, density));
        }
        return;
    }
    if (to_sky && light_densities[TO_SKY] > 0.0) arriving[TO_SKY] = sky / light_densities[TO_SKY];

    SurfacePoint point = points[0];
    uint material = surfaces[0];
    uint flags = MATERIAL_AT(material).flags;
    float twice_area = length(point.area);
    float gap = surface_gap(point);

    if (instances[1] != NONE) {
        uint m = surfaces[1];
        uint kind = MATERIAL_AT(m).flags;
        vec3 target;
        float density = sample_triangle_light(chosen, above, points[1], (kind & MATERIAL_DOUBLE_SIDED) != 0u, target);
        float alpha = MATERIAL_AT(m).base_color.a * texels[TEXTURE_SLOTS].a * colors[1].a;
        float covers = (kind & MATERIAL_MASK) != 0u ? float(alpha >= MATERIAL_AT(m).alpha_cutoff)
            : (kind & MATERIAL_BLEND) != 0u ? clamp(alpha, 0.0, 1.0) : 1.0;
        if (density > 0.0 && samples_extended) {
            arriving[TO_LIGHT] = MATERIAL_AT(m).emissive * texels[TEXTURE_SLOTS + 1u].rgb * (covers / density);
            light_densities[TO_LIGHT] = density;
            ways[TO_LIGHT] = target - above;
        }
    }
    // A directional light, and the point or spot light from the light tree.
    for (uint turn_of = 1u; turn_of < settings.turns; ++turn_of) {
        uint i = settings.turn_ways[turn_of];
        uint number = to.index;
        float probability = chosen;
        if (!scatters || i == TO_SKY) continue;
        if (i == TO_SUN) {
            number = light_targets[pick_sun(settings.suns, salts.z, unit_float(salts.w), probability)].index;
        } else if (to.instance != TARGET_PUNCTUAL) {
            continue;
        }
        Light one = light(number);
        vec3 to_light;
        arriving[i] = light_irradiance(one, above, to_light) / probability;
        ways[i] = i == TO_SUN ? to_light : one.position - above;
    }

    vec4 base = MATERIAL_AT(material).base_color * texels[TEXTURE_BASE_COLOR] * colors[0];
    vec3 normal = normalize(surface_normal(hit.instance, point));
    if (has_texture(flags, TEXTURE_NORMAL)) {
        vec4 tangent = surface_tangent(hit.instance, point);
        if (dot(tangent.xyz, tangent.xyz) > 0.0) {
            vec3 t = normalize(tangent.xyz);
            vec3 b = cross(normal, t) * tangent.w;
            vec3 mapped = (texels[TEXTURE_NORMAL].xyz * 2.0 - 1.0) * vec3(vec2(MATERIAL_AT(material).normal_scale), 1.0);
            normal = normalize(mat3(t, b, normal) * mapped);
        }
    }
    if (!front) normal = -normal;
    if (any(isnan(normal))) normal = side;
    bool unlit = (flags & MATERIAL_UNLIT) != 0u;
    float metallic = clamp(MATERIAL_AT(material).metallic * texels[TEXTURE_METALLIC_ROUGHNESS].b, 0.0, 1.0);
    float roughness = clamp(MATERIAL_AT(material).roughness * texels[TEXTURE_METALLIC_ROUGHNESS].g, 0.0, 1.0);
    float ior = MATERIAL_AT(material).ior;
    vec3 albedo = unlit ? vec3(0.0) : (1.0 - metallic) * base.rgb;
    if (path.vertex == 0u) {
        float depth = -(view.view_from_world * vec4(point.position, 1.0)).z;
        add_surface(pixel, albedo, normal, point.position, depth);
    }

    if ((settings.flags & PATH_SEES_EMISSION) != 0u) {
        vec3 emitted = MATERIAL_AT(material).emissive * texels[TEXTURE_EMISSIVE].rgb;
        if (unlit) {
            add_radiance(path, path.scattered, path.throughput * base.rgb);
        } else if (emitted != vec3(0.0) && (front || (flags & MATERIAL_DOUBLE_SIDED) != 0u)) {
            vec3 way = point.position - path.origin;
            float facing = abs(dot(side, toward)) * twice_area;
            float chance = path.density > 0.0 ? triangle_choice(hit.instance, hit.triangle, path.origin, path.side) : 0.0;
            float density = chance * 2.0 * dot(way, way) / facing;
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
    if (!diffuse_only && metallic > 0.5) normal = mirroring_normal(normal, side, -toward);
    float dielectric = (ior - 1.0) * (ior - 1.0) / ((ior + 1.0) * (ior + 1.0));
    float transmission = diffuse_only ? 0.0 : clamp(MATERIAL_AT(material).transmission * texels[TEXTURE_TRANSMISSION].r, 0.0, 1.0);
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
    float go_rough = scatters && (path.scattered < settings.bounces || sees) ? b.rough : 0.0;
    float go_sharp = path.specular < settings.specular_bounces ? b.glass + b.mirror : 0.0;
    float go = go_rough + go_sharp;

    // Evaluates the BSDF for the light samples and for the scattered ray in one loop, so that the code exists once.
    uvec4 ahead = random_words(pixel, sample_index, dimension + 3u, settings.seed);
    float pick = unit_float(ahead.x) * go;
    bool on = go > 0.0 && pick < go_rough;
    // The remainder of the number chooses between the diffuse and the glossy lobe.
    if (on) ways[ON] = bsdf_sample_rough(b, v, pick / go_rough, unit_floats(ahead.yz));
    vec3 onward = ways[ON];
    vec3 value_on = vec3(0.0);
    float density_on = 0.0;
    path.waiting = 0u;
    path.salt = salts.y;
    path.light_origin = above;
    path.light_scatterings = path.scattered + 1u;
    for (uint turn_of = 0u; turn_of < settings.turns; ++turn_of) {
        uint i = settings.turn_ways[turn_of];
        bool to_lamp = i != ON;
        if (ways[i] == vec3(0.0) || (to_lamp && (arriving[i] == vec3(0.0) || b.rough <= 0.0))) continue;
        float density;
        vec3 value = bsdf_rough(b, v, normalize(ways[i]), density);
        density = go > 0.0 ? density * (go_rough / go) : 0.0;
        if (!to_lamp) {
            value_on = value;
            density_on = density;
            continue;
        }
        vec3 arrives = value * arriving[i];
        if (arrives == vec3(0.0)) continue;
        if (light_densities[i] > 0.0 && (settings.flags & PATH_NO_BSDF_SAMPLES) == 0u) {
            arrives *= power_heuristic(light_densities[i], density);
        }
        // The ray ends a little before the light, so that the light does not occlude itself.
        WaitingLight waits = WaitingLight(ways[i], i == TO_LIGHT ? 0.99999 : 1e30, path.throughput * b.rough * arrives);
        if (i == TO_LIGHT) path.lamp = waits;
        else if (i == TO_SUN) path.sun = waits;
        else path.sky = waits;
        path.waiting |= 1u << i;
    }

    if (go <= 0.0) {
        path.alive = 0u;
        return;
    }
    path.limit = 1e30;
    if (on) {
        path.direction = onward;
        path.density = density_on;
        path.throughput *= path.density > 0.0 ? value_on * b.rough / path.density : vec3(0.0);
        path.origin = above;
        path.side = side;
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
    // `go` is the share of the lobes that are sampled. The share of the other lobes is absorbed.
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
            // Refraction scales radiance with the square of the refractive index.
            if (!b.thin) path.throughput /= b.eta * b.eta;
        }
    }
    if (path.throughput == vec3(0.0) || path.direction == vec3(0.0)) path.alive = 0u;
}
