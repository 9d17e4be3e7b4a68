// Irradiance of a distant environment in nine spherical-harmonic coefficients, already convolved with the cosine and
// with the basis constants folded in (engine/passes/ambient.rs).
struct Ambient {
    vec3 c[9];
};

// W/m² on a plane with normal n.
vec3 ambient_irradiance(Ambient a, vec3 n) {
    vec3 e = a.c[0] + a.c[1] * n.y + a.c[2] * n.z + a.c[3] * n.x + a.c[4] * n.x * n.y + a.c[5] * n.y * n.z
        + a.c[6] * (3.0 * n.z * n.z - 1.0) + a.c[7] * n.x * n.z + a.c[8] * (n.x * n.x - n.y * n.y);
    return max(e, vec3(0.0));
}
