// The sample that stands for a point of a surface: near, on the same plane, on the same side, of the same material and as free.
// Before including: prt/prt.glsl, lib/scene.glsl, and declare `grid`, `starts`, `order`, `samples` and `clearances`.

// `clearance`: free distance above the point, metres; negative: not known.

uint nearest_sample(vec3 position, vec3 side, uint material, float clearance) {
    float most = PRT_CLEAR * grid.radius;
    vec3 at = (position - grid.origin) / grid.cell;
    uint found = NONE;
    float least = 1e30;
    // Two cells along each axis hold all samples within half a cell; if there is none, three cells.
    for (uint ring = 0u; ring < 2u && found == NONE; ++ring) {
        ivec3 low = ring == 0u ? ivec3(floor(at - 0.5)) : ivec3(floor(at)) - 1;
        ivec3 high = ring == 0u ? low + 1 : low + 2;
        low = max(low, ivec3(0));
        high = min(high, ivec3(grid.counts) - 1);
        for (int z = low.z; z <= high.z; ++z) {
            for (int y = low.y; y <= high.y; ++y) {
                uint first_cell = prt_cell(grid, ivec3(low.x, y, z));
                // Cells of a row lie side by side.
                uint from = starts[first_cell], to = starts[first_cell + uint(high.x - low.x) + 1u];
                for (uint k = from; k < to; ++k) {
                    uint number = order[k];
                    float facing = dot(samples[number].side, side);
                    vec3 way = samples[number].position - position;
                    // A sample of another surface, beside or behind this one, is worse than a farther one.
                    float off = dot(way, side);
                    float score = (dot(way, way) + 64.0 * off * off) * (facing > 0.9 ? 1.0 : 3.0 - 2.0 * facing);
                    if (samples[number].material != material) score *= 4.0;
                    if (clearance >= 0.0) {
                        // Light behind a picture is not the light beside it.
                        float a = min(clearance, most), b = min(clearances[number], most);
                        float ratio = max(a, b) / max(min(a, b), 0.02 * most);
                        score *= ratio * ratio;
                    }
                    if (facing > (ring == 0u ? 0.3 : 0.0) && score < least) {
                        least = score;
                        found = number;
                    }
                }
            }
        }
    }
    return found;
}
