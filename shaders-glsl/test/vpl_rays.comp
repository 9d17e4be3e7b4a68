// The shadow rays of igi/gather.comp without interleaving, as a list: blocks of 8 × 8 pixels, in each light by light. For benchmarks.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/screen.glsl"
#include "lib/gbuffer.glsl"
#include "lib/vpl.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

struct ListedRay {
    vec3 origin;
    float t_min;
    vec3 direction;
    float t_max; // 0: none
};

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 1) uniform sampler2D normal;
layout(binding = 2) uniform sampler2D depth;
layout(binding = 3, scalar) readonly buffer Vpls { Vpl vpls[]; };
layout(binding = 4, scalar) writeonly buffer Rays { ListedRay rays[]; };

layout(push_constant, scalar) uniform Push {
    uint total;  // virtual lights
    float least; // min_d of the bounded geometry term, metres; 0: none
};

void main() {
    uvec2 extent = uvec2(textureSize(depth, 0));
    uint blocks = (extent.x + 7u) / 8u;
    uint block = gl_WorkGroupID.y * blocks + gl_WorkGroupID.x;
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    float z = all(lessThan(uvec2(pixel), extent)) ? texelFetch(depth, pixel, 0).r : 1.0;
    vec3 p = screen_position(view, pixel, 1.0, z);
    vec3 n = z < 1.0 ? decode_normal(texelFetch(normal, pixel, 0)) : vec3(0.0, 1.0, 0.0);
    vec3 origin = p + n * surface_step(view, p, z);
    for (uint k = 0u; k < total; ++k) {
        Vpl vpl = vpls[k];
        bool wanted = z < 1.0 && vpl_irradiance(vpl, p, n, least) != vec3(0.0);
        vec3 to = vpl.position + vpl.normal * vpl.gap - origin;
        rays[(block * total + k) * 64u + gl_LocalInvocationIndex] = ListedRay(origin, 0.0, to, wanted ? 0.99999 : 0.0);
    }
}
