// One light of the whole scene, drawn by its power: punctual lights, emissive triangles, the environment.
// Before including: lib/sampling.glsl, lib/scene.glsl, and define LIGHT_COLUMNS_BINDING, LIGHT_TARGETS_BINDING and
// INSTANCE_LIGHTS_BINDING.
#ifndef LIB_LIGHT_SAMPLING
#define LIB_LIGHT_SAMPLING

// LightTarget.instance of what is no triangle.
const uint TARGET_PUNCTUAL = 0xfffffffeu; // export
const uint TARGET_ENVIRONMENT = 0xfffffffdu; // export

struct LightTarget {
    uint instance; // of the emissive triangle, or TARGET_
    uint index;    // triangle within the instance, or number of the punctual light
};

layout(binding = LIGHT_COLUMNS_BINDING, scalar) readonly buffer LightColumns { AliasEntry light_columns[]; };
layout(binding = LIGHT_TARGETS_BINDING, scalar) readonly buffer LightTargets { LightTarget light_targets[]; };
// Number of the light that is the first triangle of each instance; NONE where nothing emits.
layout(binding = INSTANCE_LIGHTS_BINDING, scalar) readonly buffer InstanceLights { uint instance_lights[]; };

// Number of a light, and how probable it was.
uint pick_light(uint count, uint bits, float keep, out float probability) {
    uint index = pick_below(bits, count);
    AliasEntry column = light_columns[index];
    if (keep >= column.keep) index = column.other;
    probability = light_columns[index].probability;
    return index;
}

// How probable pick_light is to give this triangle.
float triangle_choice(uint instance, uint triangle) {
    uint first = instance_lights[instance];
    return first == NONE ? 0.0 : light_columns[first + triangle].probability;
}

#endif
