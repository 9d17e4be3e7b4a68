// Short paths from receivers to surfaces nearer than the bound of the geometry term. They compensate the light that the bound removes
// (Kollig and Keller, Illumination in the Presence of Weak Singularities, 2004).
#ifndef LIB_IGI_NEAR
#define LIB_IGI_NEAR

struct NearPath {
    vec3 position; // of the surface that the path has reached, metres
    uint alive;    // 0: the path has ended
    vec3 normal;   // shading normal
    uint salt;     // seed of its random numbers
    vec3 side;     // geometric normal
    float gap;     // step off the surface, metres
    vec3 weight;   // irradiance at the receiver per irradiance at `position`
    vec3 light;    // irradiance at the receiver, sum over its paths so far, W/m²
    float half_light; // luminance of `light` after half of the paths
};

layout(binding = 75, scalar) buffer NearPaths { NearPath near_paths[]; };

#endif
