// What surfaces send to each other: the light of lamps that they reflect, and the light of the sky and of emissive triangles that rays found.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2D sender;  // rgb radiance, a mask
layout(binding = 1) uniform sampler2D albedo;  // coarse
layout(binding = 2) uniform sampler2D normal;  // coarse, any length
layout(binding = 3) uniform sampler2D sky;     // rgb: share of the sky's irradiance that arrives, times a
layout(binding = 4) uniform sampler2D lamps;   // radiance of a white receiver
layout(binding = 5, scalar) readonly buffer Ambient { vec3 ambient[]; };
layout(binding = 6, rgba16f) uniform writeonly image2D sent;

#include "lib/ambient.glsl"

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(texel, imageSize(sent)))) return;
    vec4 own = texelFetch(sender, texel, 0);
    vec3 n = texelFetch(normal, texel, 0).xyz;
    float size = dot(n, n);
    vec3 light = texelFetch(lamps, texel, 0).rgb;
    vec4 open = texelFetch(sky, texel, 0);
    if (size > 0.0 && open.a > 0.0) light += open.rgb / open.a * ambient_irradiance(n * inversesqrt(size)) / 3.14159265358979;
    imageStore(sent, texel, vec4(own.rgb + texelFetch(albedo, texel, 0).rgb * light, own.a));
}
