// Bright parts of the environment, whose light is subtracted at most once (techniques::fiv::spots). Needs a buffer
// `FivSpot spots[]`. Include fiv/fiv.glsl before.
#ifndef LIB_FIV_SPOTS
#define LIB_FIV_SPOTS

// Irradiance of a bright part on a surface with this normal, W/m².
vec3 fiv_spot_light(uint m, vec3 n) {
    return max(n.x * spots[m].x + n.y * spots[m].y + n.z * spots[m].z, vec3(0.0));
}

// Share of a bright part that a disc around `direction` can hide. The disc radius is the sine `r`. `soft`: width of the
// disc's soft edge.
float fiv_spot_share(uint m, vec3 direction, float r, float soft) {
    float b = spots[m].radius;
    float apart = length(spots[m].direction - direction);
    float most = min(r * r / (b * b), 1.0);
    return most * clamp((r + b + soft - apart) / (2.0 * min(r, b) + soft), 0.0, 1.0);
}

#endif
