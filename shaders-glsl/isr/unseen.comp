// Light of surfaces that the picture does not show. They are as bright as a share of those that it shows to the receiver: the light that a receiver gathers, over
// the part of the hemisphere from which it comes, times the part in which rays meet surfaces. Further scatterings follow as in a closed room: light
// times 1 / (1 - k^n) after n of them, where k is the mean part of a surface's light that returns to surfaces.
#version 460
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2D gathered;  // rgb for a white receiver, times its mask
layout(binding = 1) uniform sampler2D seen;      // r: sum of the form factors of the senders
layout(binding = 2) uniform sampler2D lamps;     // a: share of the hemisphere in which rays meet no surface
layout(binding = 3) uniform sampler2D light;     // mip levels: mean of what surfaces send; a coverage
layout(binding = 4) uniform sampler2D kept;      // mip levels: mean share of light that returns to surfaces
layout(binding = 5, rgba16f) uniform writeonly image2D filled;
layout(binding = 6) uniform sampler2D albedo;    // coarse; a: mask of the receiver

layout(push_constant, scalar) uniform Push {
    uint scatterings; // that the light has; 0: more of them follow, so that none is added here
    float share;      // brightness of surfaces that the picture does not show, relative to those that it shows
    uint masked;      // 1: materials have masks
};

// Weight of the picture's mean, as a share of the hemisphere, for receivers that see little of the picture.
const float PRIOR = 0.01;
// Below this a closed room of white walls would shine without end.
const float LEAST_LOSS = 0.05;

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(texel, imageSize(filled)))) return;
    vec4 own = texelFetch(gathered, texel, 0);
    float factors = max(texelFetch(seen, texel, 0).r, 0.0);
    float closed = 1.0 - clamp(texelFetch(lamps, texel, 0).a, 0.0, 1.0);
    vec4 mean = texelFetch(light, ivec2(0), textureQueryLevels(light) - 1);
    vec3 returns = share * texelFetch(kept, ivec2(0), textureQueryLevels(kept) - 1).rgb;
    mean.a = max(mean.a, 1e-6);
    float received = masked != 0u ? texelFetch(albedo, texel, 0).a : 1.0;
    vec3 sum = (own.rgb + received * PRIOR * mean.rgb / mean.a) / (factors + PRIOR) * (factors + share * max(closed - factors, 0.0));
    if (scatterings > 0u) sum /= max(1.0 - pow(returns / mean.a, vec3(float(scatterings))), LEAST_LOSS);
    imageStore(filled, texel, vec4(sum, own.a));
}
