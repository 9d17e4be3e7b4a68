// Extents of occluders along directions (techniques::fiv::support_function). Needs a buffer `float reaches[]`. Include
// fiv/fiv.glsl before.
#ifndef LIB_FIV_REACH
#define LIB_FIV_REACH

// Coordinates of a unit normal in the support functions of all occluders.
struct FivAlong {
    uvec2 at;  // azimuth and polar angle
    vec2 part; // fraction of the way to the next entry
};

FivAlong fiv_along(vec3 n) {
    float azimuth = atan(n.x, -n.z) * (0.5 / FIV_PI);
    vec2 place = vec2((azimuth - floor(azimuth)) * float(FIV_REACH_AZIMUTHS),
                      atan(length(n.xz), n.y) * (float(FIV_REACH_POLARS - 1u) / FIV_PI));
    uvec2 at = min(uvec2(place), uvec2(FIV_REACH_AZIMUTHS - 1u, FIV_REACH_POLARS - 2u));
    return FivAlong(at, clamp(place - vec2(at), 0.0, 1.0));
}

// Extent from the centre along the normal (x) and against it (y), metres.
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

// Extent of an occluder from its centre along the normal (x) and against it (y), metres.
vec2 fiv_extent(FivOccluder o, vec3 n, FivAlong along) {
    if (o.reach == FIV_NONE) return vec2(o.radius);
    float scale = 1.0;
    if (o.turned != 0u) {
        vec3 rest = o.to_rest * n;
        scale = length(rest);
        along = fiv_along(rest / max(scale, 1e-20));
    }
    return scale * fiv_reach(o.reach, along);
}

// Share of an occluder's extent in front of a plane at distance `d` from its centre. For the bounding sphere the share
// is (d + R) / 2R (Michael, section 3.3.3.1).
float fiv_front_share(FivOccluder o, float d, vec3 n, FivAlong along) {
    if (abs(d) >= o.radius) return d > 0.0 ? 1.0 : 0.0;
    vec2 reach = fiv_extent(o, n, along);
    return clamp((d + reach.x) / max(reach.x + reach.y, 1e-20), 0.0, 1.0);
}

// Share of the irradiance of constant radiance that the part of a ball in front of the plane hides. The centre of the
// ball is `d` (metres) in front of the plane and `rho` from the receiver. Closed form (Snyder 1996). Twin:
// reference::fiv::ball.
float fiv_ball(float d, float rho, float radius) {
    float h = max(rho / radius, 1.0001);
    float c = clamp(d / max(rho, 1e-20), -1.0, 1.0);
    float squared = 1.0 - h * h * c * c;
    if (squared <= 0.0) return max(c, 0.0) / (h * h);
    float g = sqrt(h * h - 1.0);
    float side = acos(clamp(-c * g / sqrt(max(1.0 - c * c, 1e-20)), -1.0, 1.0));
    return ((c * side - sqrt(squared) * g) / (h * h) + atan(sqrt(squared) / g)) / FIV_PI;
}

// Irradiance that an occluder hides in front of the receiver's plane if the plane cuts it. `hidden`, normal · FIV, is
// this irradiance minus the irradiance from behind that the part behind the plane hides. Two estimates are possible:
// add the latter, estimated from the irradiance `behind`, or estimate the former directly from the irradiance in front,
// `open`. Both assume constant radiance and a ball of the occluder's height with holes. The estimate that is smaller
// gets the larger weight. Twin: reference::fiv::cut.
vec3 fiv_cut(FivOccluder o, vec3 offset, vec3 n, FivAlong along, vec3 hidden, vec3 open, vec3 behind) {
    vec2 reach = fiv_extent(o, n, along);
    float radius = max(0.5 * (reach.x + reach.y), 1e-20);
    float d = dot(offset, n), middle = d + 0.5 * (reach.x - reach.y);
    float rho = sqrt(max(dot(offset, offset) - d * d, 0.0) + middle * middle);
    float fill = min(o.cut_fill * o.radius * o.radius / (radius * radius), 1.0);
    vec3 under = behind * (fill * fiv_ball(-middle, rho, radius));
    vec3 over = open * (fill * fiv_ball(middle, rho, radius));
    vec3 ratio = min(under / max(over, vec3(1e-30)), vec3(1e15));
    return min(mix(over, hidden + under, 1.0 / (1.0 + ratio * ratio)), open);
}

#endif
