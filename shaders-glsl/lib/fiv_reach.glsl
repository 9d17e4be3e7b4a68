// How far occluders reach along directions (techniques::fiv::support). Needs a buffer `float reaches[]`. Include lib/fiv.glsl before.
#ifndef LIB_FIV_REACH
#define LIB_FIV_REACH

// Where a unit normal lies in the tables, for all occluders.
struct FivAlong {
    uvec2 at;  // azimuth and polar angle
    vec2 part; // of the way to the next
};

FivAlong fiv_along(vec3 n) {
    float azimuth = atan(n.x, -n.z) * (0.5 / FIV_PI);
    vec2 place = vec2((azimuth - floor(azimuth)) * float(FIV_REACH_AZIMUTHS),
                      atan(length(n.xz), n.y) * (float(FIV_REACH_POLARS - 1u) / FIV_PI));
    uvec2 at = min(uvec2(place), uvec2(FIV_REACH_AZIMUTHS - 1u, FIV_REACH_POLARS - 2u));
    return FivAlong(at, clamp(place - vec2(at), 0.0, 1.0));
}

// Metres from the centre along the normal (x) and against it (y).
vec2 fiv_reach(uint first, FivAlong along) {
    vec2 sum = vec2(0.0);
    for (uint k = 0u; k < 4u; ++k) {
        uvec2 step = uvec2(k & 1u, k >> 1u);
        vec2 weights = mix(1.0 - along.part, along.part, vec2(step));
        uvec2 at = along.at + step;
        uint over = at.y * FIV_REACH_AZIMUTHS + at.x % FIV_REACH_AZIMUTHS;
        uint under = (FIV_REACH_POLARS - 1u - at.y) * FIV_REACH_AZIMUTHS + (at.x + FIV_REACH_AZIMUTHS / 2u) % FIV_REACH_AZIMUTHS;
        sum += weights.x * weights.y * vec2(reaches[first + over], reaches[first + under]);
    }
    return sum;
}

// Share of an occluder in front of a plane at distance `d` of its centre, by the height of what it is told by.
float fiv_front_share(FivOccluder o, float d, vec3 n, FivAlong along) {
    if (abs(d) >= o.radius) return d > 0.0 ? 1.0 : 0.0;
    if (o.reach == FIV_NONE) return fiv_front(d, o.radius);
    float scale = 1.0;
    if (o.turned != 0u) {
        vec3 rest = o.to_rest * n;
        scale = length(rest);
        along = fiv_along(rest / max(scale, 1e-20));
    }
    vec2 reach = scale * fiv_reach(o.reach, along);
    return clamp((d + reach.x) / max(reach.x + reach.y, 1e-20), 0.0, 1.0);
}

#endif
