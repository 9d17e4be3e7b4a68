// Lookup of vectors. Needs a buffer `float fivs[]`, unless FIV_NO_VECTORS is defined. Include fiv/fiv.glsl before.
// Twin: reference::fiv::Set.
#ifndef LIB_FIV_LOOKUP
#define LIB_FIV_LOOKUP

#ifndef FIV_NO_VECTORS
// Sample number with fraction at `part` (0..1) of a coordinate. `knots`: float of its knots.
float fiv_number(uint knots, float part) {
    float knot = clamp(part, 0.0, 1.0) * float(FIV_SPACING_KNOTS - 1u);
    uint low = min(uint(knot), FIV_SPACING_KNOTS - 2u);
    return mix(fivs[knots + low], fivs[knots + low + 1u], knot - float(low));
}
#endif

// The eight nearest samples of an occluder.
struct FivCell {
    uvec3 at;  // numbers of the azimuth, polar angle and sphere of the first sample
    vec3 part; // fraction of the way to the next sample along each coordinate
};

// The cell of samples that contains the centre of the occluder, `offset` (metres) from the receiver. Without
// `trilinear` the cell has all weight at the nearest sample.
FivCell fiv_cell(FivOccluder o, vec3 offset, bool trilinear) {
    precise float azimuth = atan(offset.x, -offset.z) * (0.5 / FIV_PI);
    precise float a = (azimuth - floor(azimuth)) * float(o.azimuths);
    precise float p = atan(length(offset.xz), offset.y) * (float(o.polars - 1u) / FIV_PI);
    precise float r = clamp(log(max(length(offset), o.nearest) / o.nearest) * o.steps, 0.0, float(o.radii - 1u));
#ifndef FIV_NO_VECTORS
    if (o.spacing != FIV_NONE) {
        a = fiv_number(o.spacing, a / float(o.azimuths));
        p = fiv_number(o.spacing + FIV_SPACING_KNOTS, p / float(o.polars - 1u));
        r = fiv_number(o.spacing + 2u * FIV_SPACING_KNOTS, r / float(o.radii - 1u));
    }
#endif
    if (!trilinear) {
        a = floor(a + 0.5);
        p = floor(p + 0.5);
        r = floor(r + 0.5);
    }
    uvec3 at = uvec3(min(uint(a), o.azimuths - 1u), min(uint(p), o.polars - 2u), min(uint(r), o.radii - 2u));
    // At the seam the rounded azimuth is one full step after the last sample.
    return FivCell(at, clamp(vec3(a, p, r) - vec3(at), 0.0, 1.0));
}

// Weight of the k-th sample of the cell, and its number among the occluder's samples.
float fiv_corner(FivOccluder o, FivCell cell, uint k, out uint number) {
    uvec3 step = uvec3(k & 1u, k >> 1u & 1u, k >> 2u);
    vec3 weights = mix(1.0 - cell.part, cell.part, vec3(step));
    uint column = cell.at.x + step.x;
    if (column >= o.azimuths) column = 0u;
    number = ((cell.at.z + step.z) * o.polars + cell.at.y + step.y) * o.azimuths + column;
    return weights.x * weights.y * weights.z;
}

#ifndef FIV_NO_VECTORS
// Radius of a sphere of samples, metres.
float fiv_radius(FivOccluder o, uint sphere) {
    return o.spacing != FIV_NONE ? fivs[o.spacing + 3u * FIV_SPACING_KNOTS + sphere] : o.nearest * exp(float(sphere) / o.steps);
}

// normal · FIV of the light that occluder `o` hides ([FIV 11]). The occluder's centre lies at `offset` (metres) from
// the receiver. The vectors are those from the float `first` on, interpolated between the eight nearest samples or
// taken from the nearest sample. Samples inside the occluder are left out. w: the share of the interpolation weight
// that the other samples have. `scaled`: vectors are interpolated relative to the solid angle of the bounding sphere,
// which falls with the square of the distance.
vec4 fiv_dot_turn(FivOccluder o, uint first, vec3 offset, vec3 normal, bool trilinear, bool scaled) {
    FivCell cell = fiv_cell(o, offset, trilinear);
    vec2 growth = vec2(1.0);
    if (scaled) {
        vec2 radii = max(vec2(fiv_radius(o, cell.at.z), fiv_radius(o, cell.at.z + 1u)), o.radius);
        growth = radii / max(min(length(offset), o.farthest), o.radius);
        growth *= growth;
    }
    vec4 sum = vec4(0.0);
    for (uint k = 0u; k < 8u; ++k) {
        uint number;
        float weight = fiv_corner(o, cell, k, number);
        if (weight <= 0.0) continue;
        uint at = first + FIV_FLOATS * number;
        vec3 x = vec3(fivs[at], fivs[at + 1u], fivs[at + 2u]);
        if (x.x >= FIV_INSIDE) continue;
        vec3 y = vec3(fivs[at + 3u], fivs[at + 4u], fivs[at + 5u]);
        vec3 z = vec3(fivs[at + 6u], fivs[at + 7u], fivs[at + 8u]);
        float grown = (k & 4u) == 0u ? growth.x : growth.y;
        sum += vec4((normal.x * x + normal.y * y + normal.z * z) * grown, 1.0) * weight; // [FIV 11]
    }
    if (sum.w > 0.0) sum.rgb /= sum.w;
    // Beyond the last sphere the hidden light is proportional to the solid angle of the occluder.
    float beyond = min(o.farthest / max(length(offset), 1e-30), 1.0);
    return vec4(sum.rgb * (beyond * beyond), sum.w);
}

// The same, interpolated between two rotation samples.
vec4 fiv_dot(FivOccluder o, vec3 offset, vec3 normal, bool trilinear, bool scaled) {
    vec4 hidden = fiv_dot_turn(o, o.first, offset, normal, trilinear, scaled);
    if (o.blend <= 0.0) return hidden;
    return mix(hidden, fiv_dot_turn(o, o.second, offset, normal, trilinear, scaled), o.blend);
}
#endif

// Area that two discs of radii `r1` and `r2` at the distance `d` have in common ([FIV 15]). Twin: reference::fiv::lens.
float lens_area(float r1, float r2, float d) {
    if (d >= r1 + r2) return 0.0;
    if (d <= abs(r1 - r2)) {
        float r = min(r1, r2);
        return FIV_PI * r * r;
    }
    // The difference of the squares is computed as a product. A GPU may fuse one of the two squares into a sum; the
    // difference of equal radii would then not be 0, and large compared with d.
    float squares = (r1 - r2) * (r1 + r2);
    float a = clamp((d * d + squares) / (2.0 * d * r1), -1.0, 1.0);
    float b = clamp((d * d - squares) / (2.0 * d * r2), -1.0, 1.0);
    float kite = max((r1 + r2 - d) * (d + r1 - r2) * (d - r1 + r2) * (d + r1 + r2), 0.0);
    return r1 * r1 * acos(a) + r2 * r2 * acos(b) - 0.5 * sqrt(kite);
}

// Number of the tile of 8×8 pixels that contains a pixel of an image of this width.
uint fiv_tile(ivec2 pixel, int width) {
    return uint(pixel.y >> 3) * uint((width + 7) >> 3) + uint(pixel.x >> 3);
}

#endif
