// The map of important pixels as identification writes it: 1 where important, 0 elsewhere. An object mask of the same size
// can be or-ed into it.
layout(constant_id = 0) const uint HAS_MASK = 0;
layout(binding = 10) uniform sampler2D mask; // any image of that size where HAS_MASK is 0
layout(binding = 11, r32f) uniform writeonly image2D importance;

layout(push_constant, scalar) uniform Push {
    float threshold;
};

void store_importance(ivec2 pixel, bool important) {
    if (HAS_MASK != 0u && texelFetch(mask, pixel, 0).r > 0.5) important = true;
    imageStore(importance, pixel, vec4(important ? 1.0 : 0.0));
}
