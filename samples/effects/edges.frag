// Second differences of depth, which are 0 on planes, and first differences of normals.
#include "lib/gbuffer.glsl"
layout(binding = 0) uniform sampler2D picture;
layout(binding = 1) uniform sampler2D depth;
layout(binding = 2) uniform sampler2D normal;
layout(push_constant, scalar) uniform Push { vec3 ink; float paper; };
layout(location = 0) in vec2 uv;
layout(location = 0) out vec4 color;

float z(ivec2 at) {
    // The inverse of the depth is linear on planes.
    return 1.0 / max(texelFetch(depth, clamp(at, ivec2(0), textureSize(depth, 0) - 1), 0).r, 1e-6);
}

vec3 n(ivec2 at) {
    return decode_normal(texelFetch(normal, clamp(at, ivec2(0), textureSize(normal, 0) - 1), 0));
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 light = texelFetch(picture, pixel, 0);
    float own = z(pixel);
    float bend = abs(z(pixel - ivec2(1, 0)) + z(pixel + ivec2(1, 0)) - 2.0 * own)
               + abs(z(pixel - ivec2(0, 1)) + z(pixel + ivec2(0, 1)) - 2.0 * own);
    float turn = 2.0 - dot(n(pixel), n(pixel + ivec2(1, 0))) - dot(n(pixel), n(pixel + ivec2(0, 1)));
    float line = max(smoothstep(0.02, 0.06, bend / own), smoothstep(0.1, 0.4, turn));
    color = vec4(mix(mix(light.rgb, vec3(1.0), paper), ink, line), light.a);
}
