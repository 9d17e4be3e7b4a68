// Cells of triangles, for which the sun masks say at which times the sun is seen.
// Before including: daylight/daylight.glsl; the blocks `cells` (of all triangles of instance 0, then of instance 1, and so on) and `cell_firsts`
// (the first triangle of each instance in `cells`).

// The cell of a point of a triangle.
uint day_cell(uint instance, uint triangle, vec2 barycentrics) {
    DayCells of = cells[cell_firsts[instance] + triangle];
    uint columns = of.size & 0x7fffu, rows = of.size >> 15u & 0x7fffu, base = of.size >> 30u;
    vec3 w = vec3(1.0 - barycentrics.x - barycentrics.y, barycentrics);
    // Weights of the end of the longest side and of the corner opposite to it.
    vec2 along = base == 0u ? w.yz : base == 1u ? w.zx : w.xy;
    uint column = min(uint(max(along.x + of.foot * along.y, 0.0) * float(columns)), columns - 1u);
    uint row = min(uint(max(along.y, 0.0) * float(rows)), rows - 1u);
    return of.first + row * columns + column;
}

// Barycentrics of a point of a cell; `at`: its place in the part of the cell that is on the triangle, 0 to 1. All points stay a little away from the
// sides of the triangle, where rounding could put them behind the next wall.
vec2 day_cell_point(DayCells of, uint cell, vec2 at) {
    uint columns = of.size & 0x7fffu, rows = of.size >> 15u & 0x7fffu, base = of.size >> 30u;
    uint number = cell - of.first;
    // Along the longest side, where the lower end of the cell is on the triangle; then up to the nearer of the other two sides.
    float low = float(number / columns) / float(rows), column = float(number % columns);
    vec2 ends = vec2(max(column / float(columns), of.foot * low), min((column + 1.0) / float(columns), 1.0 - (1.0 - of.foot) * low));
    float along = mix(ends.x, max(ends.x, ends.y), at.x);
    float high = min(along / max(of.foot, 1e-9), (1.0 - along) / max(1.0 - of.foot, 1e-9));
    high = clamp(high, low, float(number / columns + 1u) / float(rows));
    float apex = mix(low, high, at.y);
    vec2 inside = mix(vec2(along - of.foot * apex, apex), vec2(1.0 / 3.0), 1e-3);
    float start = 1.0 - inside.x - inside.y;
    return base == 0u ? inside : base == 1u ? vec2(start, inside.x) : vec2(inside.y, start);
}
