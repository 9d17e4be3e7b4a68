// Random numbers without state: the same numbers in, the same number out, on every device.
#ifndef LIB_RANDOM
#define LIB_RANDOM

// PCG hash in four dimensions (Jarzynski and Olano, Hash Functions for GPU Rendering, 2020).
uvec4 pcg4d(uvec4 v) {
    v = v * 1664525u + 1013904223u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    v ^= v >> 16u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    return v;
}

// In [0, 1).
float random_float(uvec4 seed) {
    return float(pcg4d(seed).x >> 8u) * (1.0 / 16777216.0);
}

#endif
