// The depth of a surface at the middle of a pixel, for fragment stages. Before including: lib/view.glsl.
#ifndef LIB_PIXEL_DEPTH
#define LIB_PIXEL_DEPTH

// Linear depth (eye distance / far) at which the ray through the pixel's middle meets the plane of the triangle. `seen`: the interpolated
// position in view space, metres.
//
// GPUs move vertices to a grid of 1/256 pixel before they interpolate. `seen` lies on the triangle, but up to 1/256 pixel beside that ray:
// on a steep surface its depth puts the pixel's position so far behind the surface that its shadow rays start inside.
float pixel_depth(View view, vec3 seen) {
    vec2 uv = gl_FragCoord.xy / view.extent;
    mat3 turn = mat3(view.view_from_world);
    vec3 ray = turn * view_ray(view, uv);
    vec3 base = view.orthographic != 0u ? turn * (view_base(view, uv) - view.position) : vec3(0.0);
    vec3 across = dFdx(seen), down = dFdy(seen);
    vec3 normal = cross(across, down);
    float rough = -seen.z / view.far;
    float exact = dot(normal, seen - base) / dot(normal, ray);
    // Not a number where the triangle is seen edge-on.
    float most = (abs(across.z) + abs(down.z)) / (128.0 * view.far);
    return abs(exact - rough) <= most ? exact : rough;
}

#endif
