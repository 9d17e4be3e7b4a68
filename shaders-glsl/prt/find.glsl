// The sample that stands for a point of a surface: near, on the same plane, on the same side, of the same connected component and as free.
// Before including: prt/prt.glsl, lib/scene.glsl, lib/gbuffer.glsl, and declare `grid`, `starts`, `order` and `candidates`. Each cell lists the samples around it;
// `candidates` has the samples.

// `clearance`: free distance above the point, metres.
uint nearest_sample(vec3 position, vec3 side, uint component, float clearance) {
    float clear = min(clearance / (PRT_CLEAR * grid.radius), 1.0);
    ivec3 own = ivec3(floor((position - grid.origin) / grid.cell));
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
        for (uint k = starts[row]; k < to; ++k) {
            uint number = order[k];
            vec3 towards = octahedral_decode(unpackSnorm2x16(candidates[number].side));
            float facing = dot(towards, side);
            if (facing <= (turn == 0u ? 0.3 : 0.0)) continue;
            vec3 way = candidates[number].position - position;
            // A sample of another surface, beside or behind this one, is worse than a farther one. Along the mean normal, so that a curved surface is
            // not off its own tangent plane.
            float off = dot(way, normalize(towards + side));
            float score = (dot(way, way) + PRT_STEP * off * off) * (facing > 0.9 ? 1.0 : 3.0 - 2.0 * facing);
            uint surface = candidates[number].surface;
            if ((surface & 0xffffu) != (component & 0xffffu)) score *= PRT_STRANGE;
            // Light behind a picture is not the light beside it.
            float other = unpackHalf2x16(surface >> 16u).x;
            float ratio = max(clear, other) / max(min(clear, other), 0.02);
            score *= ratio * ratio;
            if (score < least) {
                least = score;
                found = number;
            }
        }
    }
    return found;
}
