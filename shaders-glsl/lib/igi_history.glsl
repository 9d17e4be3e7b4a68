// What instant global illumination keeps from one frame to the next. Before including: lib/view.glsl.
#ifndef LIB_IGI_HISTORY
#define LIB_IGI_HISTORY

// The frame that left the history.
struct HistoryFrame {
    View view;
    uint next; // number of the frame after it
};

// A surface at which light is gathered once more in the next frame, from the same paths, to see whether it changed.
struct HistoryProbe {
    vec3 position; // metres
    float gap;     // step off the surface, metres
    vec3 normal;   // unit
    uint there;    // 0: nothing was seen
};

// Where a virtual light came from, so that the next frame can shoot it again.
struct HistoryVpl {
    uint candidate; // place among all that the paths left
    float ratio;    // of its flux to the candidate's; 0: there was none
};

#endif
