// Specks of pixels that gather for themselves.
#ifndef LIB_IGI_SPECK
#define LIB_IGI_SPECK

// `light` dimmed to `limit` times `brightest`, the luminance of the brightest coarse texel around; limit 0: as it is. Where no texel
// around shows anything there is nothing to go by.
vec3 dimmed(vec3 light, float brightest, float limit) {
    float most = limit * brightest, bright = dot(light, vec3(0.2126, 0.7152, 0.0722));
    return most > 0.0 && bright > most ? light * (most / bright) : light;
}

#endif
