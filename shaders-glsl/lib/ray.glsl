// Rays and their hits.
#ifndef LIB_RAY
#define LIB_RAY

struct Ray {
    vec3 origin;    // world space
    float t_min;    // hits with t_min <= t < t_max count, t in lengths of direction
    vec3 direction; // any length but zero
    float t_max;
};

struct Hit {
    float t;
    vec2 barycentrics; // weights of the second and third vertex
    uint instance;     // into the scene's instances; NONE: nothing was hit
    uint triangle;     // of that instance: its indices start at first_index + 3 triangle
};

#endif
