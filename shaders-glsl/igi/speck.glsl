// Dimming of specks in pixels that gather at full resolution.
#ifndef LIB_IGI_SPECK
#define LIB_IGI_SPECK

// Limits the luminance of `light` to `limit` times `brightest`, the luminance of the brightest coarse texel in the neighbourhood. Returns
// `light` unchanged if either is 0.
vec3 dimmed(vec3 light, float brightest, float limit) {
    float most = limit * brightest, bright = dot(light, vec3(0.2126, 0.7152, 0.0722));
    return most > 0.0 && bright > most ? light * (most / bright) : light;
}

#endif
