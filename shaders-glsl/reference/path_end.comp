// The end of paths (reference/path.comp): adds their light and their first surfaces to the sums. One invocation adds all samples of a
// pixel, in their order, so that the sums have the same bits for any division of the work.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/random.glsl"
#include "reference/path.glsl"

layout(local_size_x = 64) in;

layout(binding = 13, scalar) uniform SettingsBlock { PathSettings settings; };
#include "lib/ray.glsl"

layout(binding = 14, scalar) readonly buffer Paths { PathState paths[]; };

layout(push_constant, scalar) uniform Push {
    uint first;        // reference/path_slots.glsl
    uint sample_index;
    uint count;        // paths
};

#include "reference/path_at.glsl"
#include "reference/path_slots.glsl"
#include "reference/path_sums.glsl"

void main() {
    uint begin = gl_GlobalInvocationID.x;
    if (begin >= settings.slots) return;
    uvec2 pixel = pixel_of(begin);
    if (any(greaterThanEqual(pixel, settings.extent))) return;
    PixelSums sums = load_sums(pixel);
    for (uint slot = begin; slot < count; slot += settings.slots) {
        if (unpacked_steps(PATH_AT(slot).steps).vertex > 0u) {
            add_surface(sums, PATH_AT(slot).albedo, PATH_AT(slot).normal, PATH_AT(slot).position, PATH_AT(slot).depth);
        }
        add_light(sums, PATH_AT(slot).emission, PATH_AT(slot).direct, PATH_AT(slot).indirect);
    }
    store_sums(pixel, sums);
}
