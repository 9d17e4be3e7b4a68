// The part of light whose luminance lies above a threshold.
vec3 bright_part(vec3 light, float threshold) {
    float luminance = dot(light, vec3(0.2126, 0.7152, 0.0722));
    return light * max(luminance - threshold, 0.0) / max(luminance, 1e-6);
}
