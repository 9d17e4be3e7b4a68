// Where radiance from infinity and its importance lie (lib/environment_sampling.glsl).
#ifndef LIB_ENVIRONMENT_MAP
#define LIB_ENVIRONMENT_MAP

struct EnvironmentMap {
    ivec2 size;      // texels of the radiance
    uvec2 cells;     // of the importance map, row by row
    float rotation;  // radians about +Y, counter-clockwise from above
    float scale;     // on the radiance
};

#endif
