// Samples of shapes and distributions: pure functions of uniform numbers in [0, 1).
#ifndef LIB_SAMPLING
#define LIB_SAMPLING

const float SAMPLING_PI = 3.14159265358979;

// One column of an alias table (Walker 1977; built as by Vose 1991).
struct AliasEntry {
    float keep;        // probability that a pick of this column stays
    uint other;        // where it goes else
    float probability; // of this entry, over all columns
};

// A number in [0, 1) of 24 bits.
float unit_float(uint bits) {
    return float(bits >> 8u) * (1.0 / 16777216.0);
}

vec2 unit_floats(uvec2 bits) {
    return vec2(unit_float(bits.x), unit_float(bits.y));
}

// A whole number in [0, n), without the unevenness that a float of 24 bits has for large n.
uint pick_below(uint bits, uint n) {
    uint high, low;
    umulExtended(bits, n, high, low);
    return high;
}

// Orthonormal frame whose third axis is the unit vector n (Duff et al., Building an Orthonormal Basis, Revisited, 2017).
mat3 frame_around(vec3 n) {
    float s = n.z >= 0.0 ? 1.0 : -1.0;
    float a = -1.0 / (s + n.z);
    float b = n.x * n.y * a;
    return mat3(vec3(1.0 + s * n.x * n.x * a, s * b, -s * n.x), vec3(b, s + n.y * n.y * a, -n.y), n);
}

// Uniform in the unit disc, keeping neighbours together (Shirley and Chiu, A Low Distortion Map, 1997).
vec2 sample_disc(vec2 u) {
    vec2 p = 2.0 * u - 1.0;
    bool flat_side = abs(p.x) > abs(p.y);
    float r = flat_side ? p.x : p.y;
    if (r == 0.0) return vec2(0.0);
    float phi = flat_side ? 0.25 * SAMPLING_PI * (p.y / p.x) : 0.5 * SAMPLING_PI - 0.25 * SAMPLING_PI * (p.x / p.y);
    return r * vec2(cos(phi), sin(phi));
}

// About +z with density cos θ / π per steradian.
vec3 sample_cosine(vec2 u) {
    vec2 d = sample_disc(u);
    return vec3(d, sqrt(max(1.0 - dot(d, d), 0.0)));
}

// Uniform over the cone about +z of half angle acos(cos_max): density 1 / (2π (1 − cos_max)) per steradian.
vec3 sample_cone(vec2 u, float cos_max) {
    // 1 − cos θ rather than cos θ: narrow cones keep their precision.
    float one_minus = u.x * (1.0 - cos_max);
    float s = sqrt(max(one_minus * (2.0 - one_minus), 0.0));
    float phi = 2.0 * SAMPLING_PI * u.y;
    return vec3(s * cos(phi), s * sin(phi), 1.0 - one_minus);
}

float cone_density(float cos_max) {
    return 1.0 / (2.0 * SAMPLING_PI * (1.0 - cos_max));
}

// Uniform over the sphere: density 1 / 4π per steradian.
vec3 sample_sphere(vec2 u) {
    float z = 1.0 - 2.0 * u.x;
    float s = sqrt(max(1.0 - z * z, 0.0));
    float phi = 2.0 * SAMPLING_PI * u.y;
    return vec3(s * cos(phi), s * sin(phi), z);
}

// Barycentric coordinates of the second and third corner, uniform over a triangle's area (Heitz, A Low-Distortion Map
// Between Triangle and Square, 2019).
vec2 sample_triangle(vec2 u) {
    if (u.y > u.x) {
        u.x *= 0.5;
        u.y -= u.x;
    } else {
        u.y *= 0.5;
        u.x -= u.y;
    }
    return u;
}

// GGX, normal distribution times the share that is seen from v, as a density of half vectors: D G1(v) (v·h) / v.z.
// v in the frame of the normal, v.z > 0; alpha = roughness² (Heitz, Sampling the GGX Distribution of Visible Normals, 2018).
vec3 sample_ggx_visible(vec2 u, vec3 v, float alpha) {
    vec3 stretched = normalize(vec3(alpha * v.xy, v.z));
    float flat_length = dot(stretched.xy, stretched.xy);
    vec3 t1 = flat_length > 0.0 ? vec3(-stretched.y, stretched.x, 0.0) * inversesqrt(flat_length) : vec3(1.0, 0.0, 0.0);
    vec3 t2 = cross(stretched, t1);
    float r = sqrt(u.x);
    float phi = 2.0 * SAMPLING_PI * u.y;
    float p1 = r * cos(phi);
    float p2 = r * sin(phi);
    float s = 0.5 * (1.0 + stretched.z);
    p2 = mix(sqrt(max(1.0 - p1 * p1, 0.0)), p2, s);
    vec3 h = p1 * t1 + p2 * t2 + sqrt(max(1.0 - p1 * p1 - p2 * p2, 0.0)) * stretched;
    return normalize(vec3(alpha * h.xy, max(h.z, 0.0)));
}

// GGX distribution of normals; tangent: length of h × n, which stays precise where h·n is nearly 1.
float ggx_distribution(float nh, float tangent, float alpha) {
    float a2 = alpha * alpha;
    float d = nh * nh * a2 + tangent * tangent;
    return a2 / (SAMPLING_PI * d * d);
}

// Smith's masking of one direction at cosine c > 0.
float ggx_masking(float c, float alpha) {
    float a2 = alpha * alpha;
    return 2.0 * c / (c + sqrt(a2 + (1.0 - a2) * c * c));
}

// Density per steradian of the mirrored direction l of v about a sampled half vector.
float ggx_reflected_density(vec3 h, vec3 v, float alpha) {
    return ggx_distribution(h.z, length(h.xy), alpha) * ggx_masking(v.z, alpha) / (4.0 * v.z);
}

// Which of two ways to sample gets how much of the credit: squares of their densities (Veach and Guibas 1995), b may be 0.
float power_heuristic(float a, float b) {
    float r = b / a;
    return 1.0 / (1.0 + r * r);
}

#endif
