// The view that is drawn, by the name `view`. With EYES it is that of the layer (multiview).
#ifdef EYES
struct Eyes {
    View views[2];
};
layout(binding = 0, scalar) uniform EyesBlock { Eyes eyes; };
#define view eyes.views[gl_ViewIndex]
#else
layout(binding = 0, scalar) uniform ViewBlock { View view; };
#endif
