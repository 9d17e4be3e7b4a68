// The response of photoreceptors, from 0 to 1. Whoever includes it has declared the buffers Receptor, Sums and Statistics and the push constant.

struct Adapted {
    vec3 mean;
    float luminance;
    float contrast;
};

Adapted receptor_adapted() {
    float unit = receptor_unit(uintBitsToFloat(sums.largest));
    Adapted adapted;
    for (int i = 0; i < 3; ++i) {
        adapted.mean[i] = (float(receptor.high[i]) * 4294967296.0 + float(receptor.low[i])) * unit / settings.pixels * statistics.scale;
    }
    adapted.luminance = dot(adapted.mean, vec3(0.2126, 0.7152, 0.0722));
    adapted.contrast = settings.contrast;
    if (settings.contrast == 0.0) {
        float top = log2(max(statistics.high, TONEMAP_SMALLEST));
        float bottom = log2(max(statistics.low, max(1e-6 * statistics.high, TONEMAP_SMALLEST)));
        float key = top > bottom ? clamp((top - log2(statistics.log_average)) / (top - bottom), 0.0, 1.0) : 0.0;
        adapted.contrast = 0.3 + 0.7 * pow(key, 1.4);
    }
    return adapted;
}

vec3 receptor_response(vec3 color, Adapted adapted) {
    vec3 rgb = color * statistics.scale;
    vec3 own = mix(vec3(tonemap_luminance(rgb)), rgb, settings.chromatic);
    vec3 world = mix(vec3(adapted.luminance), adapted.mean, settings.chromatic);
    vec3 level = mix(world, own, settings.local);
    vec3 response = vec3(0.0);
    for (int i = 0; i < 3; ++i) {
        if (rgb[i] > 0.0) {
            response[i] = rgb[i] / (rgb[i] + pow(settings.intensity * level[i], adapted.contrast));
        }
    }
    return response;
}
