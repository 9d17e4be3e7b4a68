// Direct light at the samples: the distance to the nearest surface in the direction of each light is rebuilt from its components and compared with
// the distance of the light (Leonhardt and Bohn, section 5, equation 9).
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "lib/sampling.glsl"
#define LIGHTS_BINDING 7
#include "lib/lights.glsl"
#include "prt/prt.glsl"
#include "prt/cap.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) readonly buffer Samples { PrtSample samples[]; };
layout(binding = 1, scalar) readonly buffer Clusters { uint clusters[]; };      // of each sample
layout(binding = 2, scalar) readonly buffer Caps { PrtCap caps[]; };
layout(binding = 3, scalar) readonly buffer Rows { uint rows[]; };              // halves: of directions and of samples
layout(binding = 4, scalar) readonly buffer Offsets { vec3 offsets[]; };        // of the points of a light, metres
layout(binding = 5, scalar) writeonly buffer Direct { vec3 direct[]; };         // irradiance, W/m²
layout(binding = 6, scalar) writeonly buffer Visible { float visible[]; };      // share of each light that a sample sees; light after light

layout(push_constant, scalar) uniform Push {
    uint count;
    uint points;          // of a light
    float bias;           // share of the distance
    float bias_distance;  // metres
    float strength;
    float far_of_room;    // unit of the stored distances, metres
};

float row_product(uint a, uint b, uint words) {
    float sum = 0.0;
    for (uint i = 0u; i < words; ++i) {
        sum += dot(unpackHalf2x16(rows[a + i]), unpackHalf2x16(rows[b + i]));
    }
    return sum;
}

// Share of a point of a light that a sample sees: the four directions around it, those above the horizon.
float seen_share(PrtSample s, PrtCap cap, uint row, vec3 direction, float far) {
    vec2 place = cap_place(cap, direction) * float(cap.side) - 0.5;
    vec2 corner = floor(place);
    vec2 f = place - corner;
    float sum = 0.0, whole = 0.0;
    for (uint i = 0u; i < 4u; ++i) {
        vec2 step = vec2(i & 1u, i >> 1u);
        vec2 cell = clamp(corner + step, vec2(0.0), vec2(float(cap.side) - 1.0));
        float weight = (step.x == 1.0 ? f.x : 1.0 - f.x) * (step.y == 1.0 ? f.y : 1.0 - f.y);
        vec3 middle = cap_direction(cap, (cell + 0.5) / float(cap.side));
        if (weight <= 0.0 || dot(middle, s.side) <= 0.0) continue;
        uint at = cap.first_row + (uint(cell.y) * cap.side + uint(cell.x)) * cap.words;
        float nearest = far_of_room * row_product(at, row, cap.words);
        // The comparison is soft over the width of the bias, so that shadows do not jump from frame to frame.
        float margin = bias * nearest + bias_distance;
        sum += weight * clamp((nearest + margin - far) / max(margin, 1e-6) + 0.5, 0.0, 1.0);
        whole += weight;
    }
    return whole > 0.0 ? sum / whole : 0.0;
}

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    PrtSample s = samples[i];
    PrtCap cap = caps[clusters[i]];
    uint row = cap.first_sample_row + (i - cap.first_sample) * cap.words;
    vec3 sum = vec3(0.0);
    for (uint l = 0u; l < light_count; ++l) {
        Light one = light(l);
        vec3 open = vec3(0.0), lit = vec3(0.0);
        for (uint p = 0u; p < points && one.kind != LIGHT_DIRECTIONAL; ++p) {
            Light point = one;
            point.position += offsets[p];
            vec3 to_light;
            vec3 e = light_irradiance(point, s.position, to_light);
            e *= max(dot(to_light, s.normal), 0.0) * strength / float(points);
            if (dot(to_light, s.side) <= 0.0 || e == vec3(0.0)) continue;
            open += e;
            lit += e * seen_share(s, cap, row, to_light, distance(point.position, s.position));
        }
        sum += lit;
        float all = open.r + open.g + open.b;
        visible[l * count + i] = all > 0.0 ? (lit.r + lit.g + lit.b) / all : 0.0;
    }
    direct[i] = sum;
}
