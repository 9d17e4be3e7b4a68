// Short paths from lit surfaces to what lies nearer than the bound, which put back what the bound takes (Kollig and Keller,
// Illumination in the Presence of Weak Singularities, 2004).
#ifndef LIB_IGI_NEAR
#define LIB_IGI_NEAR

struct NearPath {
    vec3 position; // of the surface it has come to, metres
    uint alive;
    vec3 normal;   // shading normal
    uint salt;     // of its random numbers
    vec3 side;     // of the triangle
    float gap;     // step off the surface, metres
    vec3 weight;   // irradiance where it began for each of irradiance here
    vec3 light;    // irradiance where it began, of this path and of those before it from there, W/m²
};

layout(binding = 75, scalar) buffer NearPaths { NearPath near_paths[]; };

#endif
