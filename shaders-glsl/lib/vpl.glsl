// Virtual point lights of instant global illumination: what the passes of igi/ hand to each other.
#ifndef LIB_VPL
#define LIB_VPL

// VplStart.kind
const uint START_PUNCTUAL = 0u; // export
const uint START_TRIANGLE = 1u; // export
const uint START_ENVIRONMENT = 2u; // export

// Numbers of a path's row in the table: a pair for the direction (the place, where the light is far), a pair for the place (the
// direction), and a pair for the way on from each surface.
const uint VPL_FIRST_NUMBERS = 4u; // export

// Where a path of light begins.
struct VplStart {
    uint kind;     // START_
    uint instance; // of an emissive triangle
    uint index;    // of the punctual light, or of the triangle in its instance
    float weight;  // 1 over paths and probability of this light
};

// A path of light between two dispatches.
struct VplPath {
    vec3 origin;
    uint alive;
    vec3 direction; // unit
    uint depth;     // virtual lights left behind
    vec3 flux;      // W
    float range;    // of the punctual light while on the first segment, metres; 0: no cut-off
    uint specular;  // mirrors and glass passed
};

// A surface that reflects light of a path as Lambert's law has it: π L = flux.
struct Vpl {
    vec3 position; // metres
    float gap;     // step off the surface that rounding cannot undo, metres
    vec3 normal;   // of the triangle, unit, on the lit side
    uint depth;    // 0: first surface of its path
    vec3 flux;     // reflected, W; zero: there is none
    uint path;
};

// A visible surface that candidates for virtual lights are judged by.
struct SeenPoint {
    vec3 position; // metres
    float gap;     // step off the surface, metres
    vec3 normal;
    float weight;  // 0: nothing is seen there
};

// Smooth step of Marques and Santos, section 4: 0 up to 0.8 least, 1 from 1.2 least on.
float vpl_bound(float least, float distance) {
    if (least <= 0.0) return 1.0;
    float x = clamp((distance - 0.8 * least) / (0.4 * least), 0.0, 1.0);
    return x * x * (3.0 - 2.0 * x);
}

// Irradiance (W/m²) from a virtual light at a surface with unit normal, shadows aside ([IGI 1]: L G without V).
vec3 vpl_irradiance(Vpl vpl, vec3 position, vec3 normal, float least) {
    vec3 to = vpl.position - position;
    float d2 = dot(to, to);
    float receives = dot(normal, to);
    float sends = -dot(vpl.normal, to);
    if (receives <= 0.0 || sends <= 0.0 || d2 <= 0.0) return vec3(0.0);
    return vpl.flux * (receives * sends / (3.14159265358979 * d2 * d2) * vpl_bound(least, sqrt(d2)));
}

#ifdef LIB_VIEW
// How far to step off a surface of the G-buffer at linear depth z: its place is rounded with the depth, its normal is the shading's.
float surface_step(View view, vec3 position, float z) {
    vec3 size = abs(position);
    return 1e-5 * max(max(size.x, size.y), size.z) + 2e-5 * z * view.far;
}

// The same place as far back towards the camera, where nothing lies: a surface whose edge falls on the middle of a pixel is found there a
// rounding error beyond the surface that it meets, and all rays from there would hit that one from behind.
vec3 stepped_back(View view, vec3 position, float step) {
    return position + to_camera(view, position) * step;
}
#endif

#endif
