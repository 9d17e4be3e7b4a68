// Looking up stored vectors. Needs a buffer `float fivs[]`. Include lib/fiv.glsl before. Twin: reference::fiv::Set.
#ifndef LIB_FIV_LOOKUP
#define LIB_FIV_LOOKUP

// normal · FIV of what occluder `o` hides, seen from where its centre lies at `offset` (metres): trilinear between the eight nearest
// samples, or the nearest one. Those inside of the occluder are left out; w: the share of the weight that the others have.
vec4 fiv_dot(FivOccluder o, vec3 offset, vec3 normal, bool trilinear) {
    float rho = length(offset);
    float azimuth = atan(offset.x, -offset.z) * (0.5 / FIV_PI);
    float a = (azimuth - floor(azimuth)) * float(o.azimuths);
    float p = atan(length(offset.xz), offset.y) * (float(o.polars - 1u) / FIV_PI);
    float r = clamp(log(max(rho, o.nearest) / o.nearest) * o.steps, 0.0, float(o.radii - 1u));
    if (!trilinear) {
        a = floor(a + 0.5);
        p = floor(p + 0.5);
        r = floor(r + 0.5);
    }
    uint a0 = min(uint(a), o.azimuths - 1u), p0 = min(uint(p), o.polars - 2u), r0 = min(uint(r), o.radii - 2u);
    // Rounding up at the seam is the whole way to the next sample.
    vec3 part = clamp(vec3(a - float(a0), p - float(p0), r - float(r0)), 0.0, 1.0);
    vec4 sum = vec4(0.0);
    for (uint k = 0u; k < 8u; ++k) {
        uvec3 step = uvec3(k & 1u, k >> 1u & 1u, k >> 2u);
        vec3 weights = mix(1.0 - part, part, vec3(step));
        float weight = weights.x * weights.y * weights.z;
        if (weight <= 0.0) continue;
        uint column = a0 + step.x;
        if (column >= o.azimuths) column = 0u;
        uint at = o.first + FIV_FLOATS * (((r0 + step.z) * o.polars + p0 + step.y) * o.azimuths + column);
        vec3 x = vec3(fivs[at], fivs[at + 1u], fivs[at + 2u]);
        if (x.x >= FIV_INSIDE) continue;
        vec3 y = vec3(fivs[at + 3u], fivs[at + 4u], fivs[at + 5u]);
        vec3 z = vec3(fivs[at + 6u], fivs[at + 7u], fivs[at + 8u]);
        sum += vec4(normal.x * x + normal.y * y + normal.z * z, 1.0) * weight;
    }
    if (sum.w > 0.0) sum.rgb /= sum.w;
    // Beyond the last sphere what is hidden shrinks with the solid angle.
    float beyond = min(o.farthest / max(rho, 1e-30), 1.0);
    return vec4(sum.rgb * (beyond * beyond), sum.w);
}

// Area that two discs have in common: radii and distance of the centres. Twin: reference::fiv::lens.
float lens_area(float r1, float r2, float d) {
    if (d >= r1 + r2) return 0.0;
    if (d <= abs(r1 - r2)) {
        float r = min(r1, r2);
        return FIV_PI * r * r;
    }
    float a = clamp((d * d + r1 * r1 - r2 * r2) / (2.0 * d * r1), -1.0, 1.0);
    float b = clamp((d * d + r2 * r2 - r1 * r1) / (2.0 * d * r2), -1.0, 1.0);
    float kite = max((r1 + r2 - d) * (d + r1 - r2) * (d - r1 + r2) * (d + r1 + r2), 0.0);
    return r1 * r1 * acos(a) + r2 * r2 * acos(b) - 0.5 * sqrt(kite);
}

// Share of an occluder's bounding sphere in front of a plane at distance `d` of its centre (Michael, section 3.3.3.1).
float fiv_front(float d, float radius) {
    return clamp((d + radius) / (2.0 * radius), 0.0, 1.0);
}

#endif
