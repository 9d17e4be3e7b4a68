// The triangle that hid the sun from a point at one time. It most often hides the sun at the next times too, and then a few products replace a shadow
// ray. Unlike trace_triangle(), the test is prepared for one origin, and it says nothing about rays near to the sides of the triangle.
// Before including: lib/hit_surface.glsl, lib/material.glsl, daylight/sun_ray.glsl.

// A direction is a sum of the ways from the point to the corners of the triangle, with three weights. Each weight is the product of the direction and one
// of these vectors. All are 0 if there is no triangle.
struct DayOccluder {
    vec3 weights[3];
};

// A weight below this share of their sum is too near to a side of the triangle: after rounding it could be the weight of a ray beside the triangle.
const float OCCLUDER_MARGIN = 1e-3;
// Volume of point and triangle, relative to the product of the lengths of the ways to its corners. With less volume, the triangle is seen from its side, or
// it is small and far away, and the weights are not precise.
const float OCCLUDER_VOLUME = 1e-3;
// Rounding of a coordinate, relative to the largest one.
const float OCCLUDER_ROUNDING = 1e-6;

DayOccluder no_occluder() {
    return DayOccluder(vec3[](vec3(0.0), vec3(0.0), vec3(0.0)));
}

// The triangle as an occluder, seen from a point. A triangle is no occluder if alpha may cut parts from it, or if it is too thin for the precision of its
// coordinates.
DayOccluder occluder_of(uint instance, uint triangle, vec3 from) {
    if ((MATERIAL_AT(INSTANCE_AT(instance).material).flags & (MATERIAL_MASK | MATERIAL_BLEND)) != 0u) return no_occluder();
    vec3 corners[3] = surface_corners(instance, surface_vertices(instance, triangle));
    vec3 a = corners[0] - from, b = corners[1] - from, c = corners[2] - from;
    vec3 ab = b - a, bc = c - b, ca = a - c;
    vec3 most = max(max(abs(corners[0]), abs(corners[1])), max(abs(corners[2]), abs(from)));
    float reach = max(most.x, max(most.y, most.z)), longest = max(dot(ab, ab), max(dot(bc, bc), dot(ca, ca)));
    // The lowest height is twice the area over the longest side.
    if (!(OCCLUDER_MARGIN * length(cross(ab, ca)) > OCCLUDER_ROUNDING * reach * sqrt(longest))) return no_occluder();
    vec3 across = cross(b, c);
    float volume = dot(a, across);
    if (!(abs(volume) > OCCLUDER_VOLUME * length(a) * length(b) * length(c))) return no_occluder();
    return DayOccluder(vec3[](across / volume, cross(c, a) / volume, cross(a, b) / volume));
}

// Whether the triangle is in the way of a ray from the point, well within its sides.
bool is_hidden(DayOccluder occluder, DaySunRay ray) {
    vec3 w = vec3(dot(occluder.weights[0], ray.direction), dot(occluder.weights[1], ray.direction), dot(occluder.weights[2], ray.direction));
    float sum = w.x + w.y + w.z;
    // The triangle's plane is at the distance 1 / sum.
    return min(w.x, min(w.y, w.z)) > OCCLUDER_MARGIN * sum && sum * ray.far > 1.0 + OCCLUDER_MARGIN;
}
