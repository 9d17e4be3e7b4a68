// Number of the visible occluder of each pixel at the depth of the G-buffer, which includes cutouts and blending. And
// the irradiance that reaches the pixel past its own occluder ([FIV 13]).
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/view.glsl"
#include "lib/pixel_depth.glsl"
#include "lib/gbuffer.glsl"
#include "fiv/fiv.glsl"

layout(binding = 0, scalar) uniform ViewBlock { View view; };
layout(binding = 4, scalar) readonly buffer Owners { FivOwner owners[]; }; // of each instance
layout(binding = 6) uniform sampler2D normal;
layout(binding = 7) uniform sampler2D depth;

layout(location = 0) in vec3 seen; // position in view space, metres
layout(location = 1) flat in uint instance;
layout(location = 2) in vec4 front_x;
layout(location = 3) in vec3 front_y;
layout(location = 4) in vec3 front_z;
layout(location = 5) in vec4 back_x;
layout(location = 6) in vec3 back_y;
layout(location = 7) in vec3 back_z;

layout(location = 0) out vec2 identity; // number of the occluder plus one, 0 for none; linear depth
layout(location = 1) out vec4 own;      // irradiance, W/m²; a: 1 where the irradiance is known

void main() {
    // Surfaces that the G-buffer does not show at this pixel (cut out, blended or hidden) must not cover the visible
    // surface.
    float shown = texelFetch(depth, ivec2(gl_FragCoord.xy), 0).r, linear = pixel_depth(view, seen);
    if (abs(linear - shown) > 1e-4 * shown) discard;
    FivOwner owner = owners[instance];
    identity = vec2(owner.occluder == FIV_NONE ? 0.0 : float(owner.occluder + 1u), linear);
    bool front = gl_FrontFacing != (owner.flipped != 0u);
    vec4 x = front ? front_x : back_x;
    vec3 y = front ? front_y : back_y, z = front ? front_z : back_z;
    vec3 n = decode_normal(texelFetch(normal, ivec2(gl_FragCoord.xy), 0));
    // Vertices inside other parts are left out. If all vertices lie inside, no light arrives.
    vec3 light = x.w > 1e-6 ? max(n.x * x.rgb + n.y * y + n.z * z, vec3(0.0)) / x.w : vec3(0.0);
    own = owner.front == FIV_NONE ? vec4(0.0) : vec4(light, 1.0);
}
