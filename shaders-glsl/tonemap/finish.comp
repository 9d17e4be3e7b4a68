// From sums to statistics, and their adaptation in time: exponential in stops, with a limit to its speed; the same in one step or in many.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "tonemap/tonemap.glsl"

layout(local_size_x = 1) in;

layout(binding = 0, scalar) readonly buffer Sums {
    uint least;
    uint largest;
    uint log_low;
    uint log_high;
    uint lit;
} sums;
layout(binding = 1, scalar) readonly buffer Found {
    uint value[2];  // bits of both percentiles
    uint rank[2];
} found;
layout(binding = 2, scalar) buffer Statistics { TonemapStatistics statistics; };

layout(push_constant, scalar) uniform Push {
    uint percentiles;  // 1: `found` counts
    uint normalize;
    uint adapt;        // 1: go on from the last frame
    float dt;          // seconds since the last frame
    float up;          // time constant to a brighter value, s; 0: at once
    float down;
    float limit;       // most stops a second
    float exposure;    // factor
};

// Stops below this are black: the way from black to a picture must have a beginning.
const float BLACK = -40.0;
// Differences below this many stops are gone at once, so that a still picture comes to rest.
const float REST = 1e-4;

float stops(float l) {
    return max(log2(max(l, TONEMAP_SMALLEST)), BLACK);
}

float adapted(float before, float now) {
    float from = stops(before);
    float to = stops(now);
    float way = to - from;
    if (dt == 0.0) {
        return before;
    }
    float tau = way > 0.0 ? up : down;
    // As long as the exponential would be faster than the limit, that is the speed: until limit * tau stops are left.
    float steady = clamp((abs(way) - limit * tau) / limit, 0.0, dt);
    float rest = abs(way) - limit * steady;
    if (steady < dt) {
        rest *= tau > 0.0 ? exp((steady - dt) / tau) : 0.0;
    }
    if (rest <= REST) {
        return now;
    }
    return exp2(to - sign(way) * rest);
}

void main() {
    // Mean of the logarithms, without black pixels: 64 bits by 32, bit by bit; the quotient has 32.
    uint remainder = 0u;
    uint quotient = 0u;
    for (int bit = 63; bit >= 0; --bit) {
        uint next = bit >= 32 ? sums.log_high >> (bit - 32) & 1u : sums.log_low >> bit & 1u;
        bool over = (remainder & 0x80000000u) != 0u;
        remainder = remainder << 1 | next;
        quotient <<= 1;
        if (over || remainder >= sums.lit) {
            remainder -= sums.lit;
            quotient |= 1u;
        }
    }
    float mean = (float(int(quotient) - (152 << 20)) + float(remainder) / float(sums.lit)) / 1048576.0;

    TonemapStatistics next = statistics;
    float low = uintBitsToFloat(percentiles != 0u ? found.value[0] : sums.least);
    float high = uintBitsToFloat(percentiles != 0u ? found.value[1] : sums.largest);
    float log_average = sums.lit > 0u ? exp2(mean) : 1e-6;
    next.frame_low = low;
    next.frame_high = high;
    next.frame_log_average = log_average;
    bool going = adapt != 0u && statistics.frames > 0u;
    next.low = going ? adapted(statistics.low, low) : low;
    next.high = going ? adapted(statistics.high, high) : high;
    next.log_average = going ? adapted(statistics.log_average, log_average) : log_average;
    next.scale = normalize != 0u ? exposure / next.log_average : 1.0;
    next.frames = min(statistics.frames, 0xFFFFFFFEu) + 1u;
    statistics = next;
}
