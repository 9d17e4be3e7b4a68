// The sample that stands for a point of a surface: near, on the same plane, on the same side, of the same material and as free.
// Before including: prt/prt.glsl, lib/scene.glsl, lib/gbuffer.glsl, and declare `grid`, `starts`, `order` and `near`. The cells have lists of all samples
// around them; `near` has for each entry what decides, packed by `Nearby::packed`.

// `clearance`: free distance above the point, metres.
uint nearest_sample(vec3 position, vec3 side, uint material, float clearance) {
    float clear = min(clearance / (PRT_CLEAR * grid.radius), 1.0);
    vec3 at = (position - grid.origin) / grid.cell;
    ivec3 own = ivec3(floor(at));
    uint found = NONE;
    float least = 1e30;
    // If the own cell has no sample, the lists of its neighbours at the corners have all samples of all neighbours.
    for (uint turn = 0u; turn < 9u; ++turn) {
        if (turn == 1u && found != NONE) break;
        uint corner = turn - 1u;
        ivec3 cell = own;
        if (turn > 0u) cell += 2 * ivec3(corner & 1u, (corner >> 1u) & 1u, corner >> 2u) - 1;
        if (any(lessThan(cell, ivec3(0))) || any(greaterThanEqual(cell, ivec3(grid.counts)))) continue;
        uint row = prt_cell(grid, cell);
        uint to = starts[row + 1u];
        vec3 local = at - vec3(cell) + 1.0;
        for (uint k = starts[row]; k < to; ++k) {
            uvec4 words = near[k];
            vec3 towards = octahedral_decode(unpackSnorm2x16(words.z));
            float facing = dot(towards, side);
            if (facing <= (turn == 0u ? 0.3 : 0.0)) continue;
            vec3 way = 3.0 * vec3(unpackUnorm2x16(words.x), unpackUnorm2x16(words.y).x) - local;
            // A sample of another surface, beside or behind this one, is worse than a farther one. Along the mean normal, so that a curved surface is
            // not off its own tangent plane.
            float off = dot(way, normalize(towards + side));
            float score = (dot(way, way) + 64.0 * off * off) * (facing > 0.9 ? 1.0 : 3.0 - 2.0 * facing);
            if (words.y >> 16u != (material & 0xffffu)) score *= 4.0;
            // Light behind a picture is not the light beside it.
            float other = unpackHalf2x16(words.w).x;
            float ratio = max(clear, other) / max(min(clear, other), 0.02);
            score *= ratio * ratio;
            if (score < least) {
                least = score;
                found = k;
            }
        }
    }
    return found == NONE ? NONE : order[found];
}
