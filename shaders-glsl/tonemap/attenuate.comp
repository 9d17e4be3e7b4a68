// Attenuation of gradients: φ of this level, times the Φ of the next coarser level read bilinearly (Fattal 2002, section 4).
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 8, local_size_y = 8) in;

// 1: there is a coarser level.
layout(constant_id = 0) const uint HAS_COARSE = 0;

layout(binding = 0) uniform sampler2D gradient;
layout(binding = 1) uniform sampler2D coarse;
layout(binding = 2, scalar) readonly buffer Means { float means[]; };
layout(binding = 3, r32f) uniform writeonly image2D attenuation;

layout(push_constant, scalar) uniform Push {
    float alpha;  // of the mean gradient of the level
    float beta;
    float least;  // smallest gradient that is told apart, as a share of α
    uint level;
};

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(at, imageSize(attenuation)))) return;
    float kept = alpha * means[level];
    float factor = 1.0;
    if (kept > 0.0) {
        factor = exp2((beta - 1.0) * log2(max(texelFetch(gradient, at, 0).r / kept, least)));
    }
    if (HAS_COARSE != 0u) {
        ivec2 near = at >> 1;
        ivec2 far = clamp(near + 2 * (at & 1) - 1, ivec2(0), textureSize(coarse, 0) - 1);
        float upper = mix(texelFetch(coarse, near, 0).r, texelFetch(coarse, ivec2(far.x, near.y), 0).r, 0.25);
        float lower = mix(texelFetch(coarse, ivec2(near.x, far.y), 0).r, texelFetch(coarse, far, 0).r, 0.25);
        factor *= mix(upper, lower, 0.25);
    }
    imageStore(attenuation, at, vec4(factor));
}
