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

// Barycentrics of a point of a cell; `at`: its place in the cell, 0 to 1. Cells at the sides of a triangle lie half outside; their points move
// onto it along the longest side. All points stay a little away from the sides, where rounding could put them behind the next wall.
vec2 day_cell_point(DayCells of, uint cell, vec2 at) {
    uint columns = of.size & 0x7fffu, rows = of.size >> 15u & 0x7fffu, base = of.size >> 30u;
    uint number = cell - of.first;
    vec2 place = (vec2(float(number % columns), float(number / columns)) + at) / vec2(float(columns), float(rows));
    float before = of.foot * place.y;
    float end = clamp(place.x - before, 0.0, 1.0 - place.y);
    vec2 inside = mix(vec2(end, place.y), vec2(1.0 / 3.0), 1e-3);
    end = inside.x;
    place.y = inside.y;
    float start = 1.0 - end - place.y;
    return base == 0u ? vec2(end, place.y) : base == 1u ? vec2(start, end) : vec2(place.y, start);
}
