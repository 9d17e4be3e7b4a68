// Share of the hemisphere around a surface that the depths of the picture leave open.
#include "lib/view.glsl"
#include "lib/gbuffer.glsl"
#include "lib/random.glsl"
layout(binding = 0) uniform sampler2D depth;
layout(binding = 1) uniform sampler2D normal;
layout(binding = 2, scalar) uniform ViewBlock { View view; };
layout(push_constant) uniform Push { float radius; uint seed; };
layout(location = 0) in vec2 uv;
layout(location = 0) out float open;

const int SAMPLES = 24;

void main() {
    float z = textureLod(depth, uv, 0.0).r;
    open = 1.0;
    if (z >= BACKGROUND_DEPTH) return;
    vec3 at = world_from_depth(view, uv, z);
    vec3 n = decode_normal(textureLod(normal, uv, 0.0));
    float closed = 0.0;
    for (int i = 0; i < SAMPLES; ++i) {
        uvec4 hash = pcg4d(uvec4(uvec2(gl_FragCoord.xy), uint(i), seed));
        vec3 u = vec3(hash.xyz >> 8u) / 16777216.0;
        float z0 = 2.0 * u.x - 1.0, angle = 6.2831853 * u.y;
        vec3 way = vec3(sqrt(max(1.0 - z0 * z0, 0.0)) * vec2(cos(angle), sin(angle)), z0);
        // Directions with the density of the cosine, lengths that favour the near.
        way = normalize(way + n * 1.001) * radius * u.z;
        vec3 probe = at + way + n * 0.002 * z * view.far;
        vec2 seen = uv_of(view, probe);
        if (any(lessThan(seen, vec2(0.0))) || any(greaterThan(seen, vec2(1.0)))) continue;
        float surface = textureLod(depth, seen, 0.0).r * view.far;
        float own = depth_of(view, probe) * view.far;
        // Surfaces far before the probe belong to other things.
        if (surface < own) closed += smoothstep(0.0, 1.0, radius / max(own - surface, 1e-6));
    }
    open = 1.0 - closed / float(SAMPLES);
}
