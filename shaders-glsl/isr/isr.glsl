// Image-space radiosity: form factor, occlusion, and the samples around a pixel. Twin: engine/reference/isr.rs.

const float ISR_PI = 3.14159265358979;

// Which receiver cell of a surface a pixel sees, m²: the pixel's area at its depth on a plane facing the camera axis, turned
// onto the surface. `ray` is not normalised; `grazing` bounds the stretch (1 / smallest cosine).
float isr_footprint(float facing_area, vec3 axis, vec3 ray, vec3 normal) {
    float along = dot(axis, ray);
    return facing_area * along / max(abs(dot(normal, ray)), 0.05 * along);
}

// [ISR 6] without dA: cos P · cos X / (π r²), with `extra` (m²) added to π r² against the singularity.
float isr_form_factor(vec3 p, vec3 p_normal, vec3 x, vec3 x_normal, float extra) {
    vec3 to = x - p;
    float r2 = dot(to, to);
    // cos · r each, so that only one division by r⁴ = (r²)² remains.
    float cosines = max(dot(p_normal, to), 0.0) * max(-dot(x_normal, to), 0.0);
    return cosines <= 0.0 ? 0.0 : cosines / (r2 * (ISR_PI * r2 + extra));
}

// [ISR 26] without 2π/N: the spherical cap that an occluder of `radius` at x covers, weighted by the cosine.
// `bias` is subtracted from the cosine: 8-bit normals make flat surfaces occlude themselves.
float isr_occlusion(vec3 p, vec3 normal, vec3 x, float radius, float bias) {
    vec3 to = x - p;
    float r = length(to);
    if (r < 1e-6) {
        return 0.0;
    }
    float s = clamp(radius / r, 0.0, 1.0);
    return (1.0 - sqrt(1.0 - s * s)) * max(dot(normal, to) / r - bias, 0.0);
}

// Samples to each side of the pixel: 24, 48, 80, 120, 168, 224 are 5², 7², 9², 11², 13², 15² without the centre.
uint isr_half_width(uint samples) {
    // (2n + 1)² is samples + 1; half a sample more keeps the root off the whole number.
    return uint((sqrt(float(samples) + 1.5) - 1.0) * 0.5);
}

// Samples of a pixel whose depth is `relative` to the mean of the picture: one step more (up to 80) or less (down to 24) than `samples`.
uint isr_samples_at(float relative, uint samples) {
    uint n = isr_half_width(samples);
    if (relative < 0.5) n = n < 4u ? n + 1u : n;
    if (relative > 1.5) n = max(n - 1u, 2u);
    return 4u * n * (n + 1u);
}

// Point of the square [-1, 1]² rim at s in [0, 1), counter-clockwise from (1, -1).
vec2 isr_rim(float s) {
    float at = fract(s) * 4.0;
    float t = fract(at) * 2.0 - 1.0;
    return at < 1.0 ? vec2(1.0, t) : at < 2.0 ? vec2(-t, 1.0) : at < 3.0 ? vec2(-1.0, -t) : vec2(t, -1.0);
}

// Where in its cell sample i lies: the pixel's place moved on by a different step for each sample, or else the error of all
// samples would have the same pattern.
vec2 isr_within(uint i, vec2 jitter) {
    return fract(jitter + float(i) * vec2(0.7548776662, 0.6180339887));
}

// Offset (xy, pixels) of sample i and the image area (z, pixels²) it stands for.
//
// Grid: the dissertation's square grid of spacing reach / half_width.
// Rings: as many samples, 8k on square ring k, with no hole in the middle; ring radius ∝ m^spread, so that spread > 1 puts
// more samples near the pixel, where the form factor is large. `jitter` in [0, 1)² moves a sample within its cell.
vec3 isr_sample(uint i, uint samples, bool rings, float reach, float spread, vec2 jitter, bool jittered) {
    uint n = isr_half_width(samples);
    vec2 within = jittered ? isr_within(i, jitter) : vec2(0.5);
    if (!rings) {
        float spacing = reach / float(n);
        uint side = 2u * n + 1u;
        uint cell = i < samples / 2u ? i : i + 1u;
        vec2 at = vec2(float(cell % side), float(cell / side)) - float(n) + within - 0.5;
        return vec3(at * spacing, spacing * spacing);
    }
    // The rings up to this one have (2 · ring + 1)² − 1 samples.
    uint ring = uint((sqrt(float(i) + 1.5) + 1.0) * 0.5);
    float k = float(ring);
    float q = float(i - 4u * ring * (ring - 1u));
    float m = (k - 1.0 + within.y) / float(n);
    float radius = reach * pow(m, spread);
    float area;
    if (jittered) {
        area = spread * reach * reach * pow(m, 2.0 * spread - 1.0) / (k * float(n));
    } else {
        float outer = pow(k / float(n), 2.0 * spread);
        float inner = ring == 1u ? 0.0 : pow((k - 1.0) / float(n), 2.0 * spread);
        area = reach * reach * (outer - inner) / (2.0 * k);
    }
    return vec3(isr_rim((q + within.x) / (8.0 * k)) * radius, area);
}

// The place within a cell that pixel (x, y) uses: a lattice whose steps are powers of the root of t⁵ = t + 1, so that the
// pixels of any small block are spread evenly over the cell and a blur averages them.
vec2 isr_jitter(ivec2 pixel) {
    return fract(float(pixel.x) * vec2(0.8566748839, 0.7338918566) + float(pixel.y) * vec2(0.6287067210, 0.5385972572));
}
