// Virtual point lights of instant global illumination: the data that the passes of igi/ share.
#ifndef LIB_VPL
#define LIB_VPL

// VplStart.kind
const uint START_PUNCTUAL = 0u; // export
const uint START_TRIANGLE = 1u; // export
const uint START_ENVIRONMENT = 2u; // export

// Numbers at the start of a path's row in the Halton table. For near lights the first pair gives the direction and the second pair the
// position; for distant lights the first pair gives the position and the second pair the direction. Then follows a pair for the direction
// after each bounce.
const uint VPL_FIRST_NUMBERS = 4u; // export

// The start of a light path.
struct VplStart {
    uint kind;     // START_
    uint instance; // of an emissive triangle
    uint index;    // of the punctual light, or of the triangle in its instance
    float weight;  // 1 / (number of paths × probability of this light)
};

// The state of a light path between two dispatches.
struct VplPath {
    vec3 origin;
    uint alive;
    vec3 direction; // unit
    uint depth;     // number of virtual lights that the path has left
    vec3 flux;      // W
    float range;    // of the punctual light on the first segment, metres; 0: no cut-off
    uint specular;  // number of mirrors and glass surfaces passed
};

// A virtual light: a surface point that reflects a path's flux by Lambert's law. Its intensity along the normal is flux / π, W/sr.
struct Vpl {
    vec3 position; // metres
    float gap;     // step off the surface, larger than its rounding error, metres
    vec3 normal;   // geometric normal, unit, on the lit side
    uint depth;    // 0: first surface of its path
    vec3 flux;     // reflected, W; zero: no light
    uint path;
};

// A visible point that measures the importance of candidates.
struct SeenPoint {
    vec3 position; // metres
    float gap;     // step off the surface, metres
    vec3 normal;
    float weight;  // luminance of the albedo; 0: background or unlit
};

// The bound of the geometry term: the smooth step of Marques and Santos, section 4. 0 up to 0.8 least, 1 from 1.2 least on.
float vpl_bound(float least, float distance) {
    if (least <= 0.0) return 1.0;
    float x = clamp((distance - 0.8 * least) / (0.4 * least), 0.0, 1.0);
    return x * x * (3.0 - 2.0 * x);
}

// Unoccluded irradiance (W/m²) from a virtual light at a surface with unit normal ([IGI 1]: L G without V).
vec3 vpl_irradiance(Vpl vpl, vec3 position, vec3 normal, float least) {
    vec3 to = vpl.position - position;
    float d2 = dot(to, to);
    float receives = dot(normal, to);
    float sends = -dot(vpl.normal, to);
    if (receives <= 0.0 || sends <= 0.0 || d2 <= 0.0) return vec3(0.0);
    return vpl.flux * (receives * sends / (3.14159265358979 * d2 * d2) * vpl_bound(least, sqrt(d2)));
}

#ifdef LIB_VIEW
// Step off a surface of the G-buffer at linear depth z, metres. The step exceeds the rounding error of the position, which grows with the
// depth.
float surface_step(View view, vec3 position, float z) {
    vec3 size = abs(position);
    return 1e-5 * max(max(size.x, size.y), size.z) + 2e-5 * z * view.far;
}

// The position, moved by `step` towards the camera, where there is free space. At an edge between two surfaces rounding may place a visible
// point behind the other surface; all rays from there would hit this surface from behind.
vec3 stepped_back(View view, vec3 position, float step) {
    return position + to_camera(view, position) * step;
}
#endif

#endif
