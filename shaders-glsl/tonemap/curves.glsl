// Curves of colours, each from its published definition. Linear Rec. 709 in, linear Rec. 709 relative to the display's white out.

// Stephen Hill's fit of the ACES RRT and ODT for sRGB, 2015: matrices are Rec. 709 to AP1 with the RRT's desaturation, and back with the ODT's.
vec3 tonemap_aces(vec3 color) {
    const mat3 into = transpose(mat3(0.59719, 0.35458, 0.04823, 0.07600, 0.90834, 0.01566, 0.02840, 0.13383, 0.83777));
    const mat3 back = transpose(mat3(1.60475, -0.53108, -0.07367, -0.10208, 1.10813, -0.00605, -0.00327, -0.07276, 1.07602));
    vec3 v = into * min(color, vec3(1e9));
    vec3 fitted = (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.4329510) + 0.238081);
    return back * fitted;
}

float tonemap_agx_sigmoid(float x) {
    const float pivot = 20.0 / 33.0;
    bool toe = x < pivot;
    float power = toe ? 3.0 : 3.25;
    float room = toe ? pivot : 1.0 - pivot;
    float factor = pow(4.0, power) - pow(room, -power);
    return 0.5 + 2.0 * (x - pivot) * pow(1.0 + factor * pow(abs(x - pivot), power), -1.0 / power);
}

// Troy Sobotka's AgX, base look; the matrices are those of his configuration for OpenColorIO.
vec3 tonemap_agx(vec3 color) {
    const mat3 inset = mat3(0.842479062253094, 0.0423282422610123, 0.0423756549057051, 0.0784335999999992,
                            0.878468636469772, 0.0784336, 0.0792237451477643, 0.0791661274605434, 0.879142973793104);
    const float least = -12.47393;
    const float most = 4.026069;
    vec3 v = inset * color;
    v = clamp((log2(max(v, vec3(1e-10))) - least) / (most - least), 0.0, 1.0);
    v = vec3(tonemap_agx_sigmoid(v.r), tonemap_agx_sigmoid(v.g), tonemap_agx_sigmoid(v.b));
    return pow(max(inverse(inset) * v, vec3(0.0)), vec3(2.2));
}

// Khronos PBR Neutral, specification of 2024.
vec3 tonemap_neutral(vec3 color) {
    const float start = 0.8 - 0.04;
    const float desaturation = 0.15;
    float least = min(color.r, min(color.g, color.b));
    float offset = least < 0.08 ? least - 6.25 * least * least : 0.04;
    color -= offset;
    float peak = max(color.r, max(color.g, color.b));
    if (peak < start) {
        return color;
    }
    float d = 1.0 - start;
    float compressed = 1.0 - d * d / (peak + d - start);
    color *= compressed / peak;
    float grey = 1.0 - 1.0 / (desaturation * (peak - compressed) + 1.0);
    return mix(color, vec3(compressed), grey);
}
