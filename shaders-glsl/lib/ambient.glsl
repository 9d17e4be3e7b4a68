// Irradiance of a distant environment as a function of the normal: linear between the nodes of a finely divided octahedron
// (engine/passes/ambient.rs), and small bright lights by themselves. Before including: a buffer `ambient` of vec3, W/m².

const uint AMBIENT_STEPS = 64u; // export
// Bright lights that stand behind the nodes, three vectors each: direction times irradiance of red, green, blue.
const uint AMBIENT_SUNS = 8u; // export

uint ambient_node(ivec2 at) {
    const int steps = int(AMBIENT_STEPS);
    return uint((at.y + steps) * (2 * steps + 1) + at.x + steps);
}

// W/m² on a plane with normal n.
vec3 ambient_irradiance(vec3 n) {
    const float steps = float(AMBIENT_STEPS);
    vec3 a = abs(n);
    // The octahedron |x| + |y| + |z| = 1 seen from +y; its lower half is folded outwards.
    vec2 p = a.xz / (a.x + a.y + a.z);
    if (n.y < 0.0) p = 1.0 - p.yx;
    vec2 q = p * steps;
    vec2 base = min(floor(q), steps - 1.0);
    vec2 f = q - base;
    // Cells are cut into triangles so that none reaches over a fold.
    bool outer = f.x + f.y > 1.0;
    ivec2 side = mix(ivec2(1), ivec2(-1), lessThan(n.xz, vec2(0.0)));
    ivec2 at = ivec2(base), far = ivec2(outer ? 1 : 0);
    vec3 weights = outer ? vec3(f.x + f.y - 1.0, 1.0 - f.y, 1.0 - f.x) : vec3(1.0 - f.x - f.y, f.x, f.y);
    vec3 sum = weights.x * ambient[ambient_node(side * (at + far))] + weights.y * ambient[ambient_node(side * (at + ivec2(1, 0)))]
        + weights.z * ambient[ambient_node(side * (at + ivec2(0, 1)))];
    const uint first = (2u * AMBIENT_STEPS + 1u) * (2u * AMBIENT_STEPS + 1u);
    for (uint k = first; k < first + 3u * AMBIENT_SUNS; k += 3u) {
        sum += max(vec3(dot(n, ambient[k]), dot(n, ambient[k + 1u]), dot(n, ambient[k + 2u])), 0.0);
    }
    return sum;
}
