// Light of the samples around a point: their mean with Gaussian weights, over those of the same side and plane.
// Before including: lib/scene.glsl, prt/prt.glsl, and declare `grid`, `starts`, `order`, `samples`, `irradiances` and `visible`. With PRT_LOBE (prt/lobe.glsl)
// the radiance over a lobe of directions is found, too: declare `terms`.

struct PrtKernel {
    float splat;       // standard deviation of the weights, in distances of samples
    uint count;        // samples
    uint first_light;  // of those whose visibility is gathered
    uint lights;       // at most PRT_LIGHTS
#ifdef PRT_LOBE
    bool glossy;       // with the radiance
    PrtLobe lobe;
#endif
};

struct PrtNear {
    vec3 irradiance;
    vec3 radiance;     // mean over the lobe, W/(m² sr); 0 without a lobe
    float visible[PRT_LIGHTS];
    uint nearest;
    float away;        // of the nearest one, in distances of samples
};

PrtNear near_samples(vec3 position, vec3 n, PrtKernel kernel) {
    PrtNear found;
    found.irradiance = vec3(0.0);
    found.radiance = vec3(0.0);
    found.nearest = NONE;
    found.away = 1e30;
    float lights[PRT_LIGHTS];
    for (uint l = 0u; l < PRT_LIGHTS; ++l) lights[l] = 0.0;
    float sum = 0.0;
    float inverse = 0.5 / (kernel.splat * kernel.splat * grid.radius * grid.radius);
    ivec3 middle = ivec3(floor((position - grid.origin) / grid.cell));
    ivec3 low = max(middle - 1, ivec3(0)), high = min(middle + 1, ivec3(grid.counts) - 1);
    // First with samples that face as the pixel does; a leaf or an edge may have none.
    for (uint turn = 0u; turn < 2u && sum <= 0.0; ++turn) {
        for (int z = low.z; z <= high.z; ++z) {
            for (int y = low.y; y <= high.y; ++y) {
                if (low.x > high.x) continue;
                uint row = prt_cell(grid, ivec3(low.x, y, z));
                uint to = starts[row + uint(high.x - low.x) + 1u];
                for (uint k = starts[row]; k < to; ++k) {
                    uint i = order[k];
                    vec3 way = samples[i].position - position;
                    float facing = dot(samples[i].normal, n);
                    float square = dot(way, way);
                    if (facing <= (turn == 0u ? 0.5 : 0.0)) continue;
                    // Away from the tangent plane counts more, so that light does not leak over steps and between sheets.
                    float off = dot(way, n);
                    square += PRT_STEP * off * off;
                    float kernel_weight = exp(-square * inverse) * facing * facing;
                    float weight = kernel_weight * samples[i].weight;
                    if (turn == 1u) weight += 1e-12 / (1e-9 + square);
                    if (square < found.away) {
                        found.away = square;
                        found.nearest = i;
                    }
                    if (kernel_weight < 1e-9 && turn == 0u) continue;
                    sum += weight;
                    found.irradiance += weight * irradiances[i];
#ifdef PRT_LOBE
                    if (kernel.glossy) {
                        vec3[PRT_LOBES] of;
                        for (uint k = 0u; k < PRT_LOBES; ++k) of[k] = terms[PRT_LOBES * i + k];
                        found.radiance += weight * prt_radiance(kernel.lobe, samples[i].normal, max(irradiances[i], vec3(0.0)) / BRDF_PI, of);
                    }
#endif
                    for (uint l = 0u; l < kernel.lights; ++l) lights[l] += weight * visible[(kernel.first_light + l) * kernel.count + i];
                }
            }
        }
    }
    float scale = sum > 0.0 ? 1.0 / sum : 0.0;
    found.irradiance *= scale;
    found.radiance *= scale;
    for (uint l = 0u; l < PRT_LIGHTS; ++l) found.visible[l] = lights[l] * scale;
    found.away = sqrt(found.away) / grid.radius;
    return found;
}
