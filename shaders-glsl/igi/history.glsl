// Data of the history, which passes from one frame to the next.
#ifndef LIB_IGI_HISTORY
#define LIB_IGI_HISTORY

// A surface point at which the next frame gathers the light of the same paths again, to measure the change of the light.
struct HistoryProbe {
    vec3 position; // metres
    float gap;     // step off the surface, metres
    vec3 normal;   // unit
    uint there;    // 0: background, no surface
};

// The origin of a virtual light, with which the next frame can recompute it.
struct HistoryVpl {
    uint candidate; // index of the candidate that it is
    float ratio;    // its flux over the candidate's flux; 0: no light
};

#endif
