// Ashikhmin 2002, as restated by Michael 2010, section 4.3. Luminances in cd/m².

// ln(to / from) that keeps its digits where both are near each other.
float ashikhmin_log_ratio(float from, float to) {
    float d = (to - from) / from;
    return d < 0.01 ? d * (1.0 - d * (0.5 - d * (1.0 / 3.0 - d * 0.25))) : log(to / from);
}

// C(to) − C(from) for 0 ≤ from ≤ to, where the perceptual capacity C of a luminance are the just noticeable differences below it: the integral
// of 1 / TVI, l / 0.0014 below 0.0034, then ln(l / 0.0034) / 0.4027 to 1, (l − 1) / 0.4027 to 7.2444, ln(l / 7.2444) / 0.0556 above. Added up
// piece by piece, for C itself is too large for differences of near luminances in 32 bits. The paper's constants of the pieces (2.4483, 16.5630,
// 32.0693) have four digits and leave steps of 0.02, 0.00002 and −0.00003 between them; in an even picture such a step is much of the range.
float ashikhmin_steps(float from, float to) {
    float steps = 0.0;
    if (from < 0.0034) {
        steps += (min(to, 0.0034) - from) / 0.0014;
    }
    if (from < 1.0 && to >= 0.0034) {
        steps += ashikhmin_log_ratio(max(from, 0.0034), min(to, 1.0)) / 0.4027;
    }
    if (from < 7.2444 && to >= 1.0) {
        steps += (min(to, 7.2444) - max(from, 1.0)) / 0.4027;
    }
    if (to >= 7.2444) {
        steps += ashikhmin_log_ratio(max(from, 7.2444), to) / 0.0556;
    }
    return steps;
}

// Threshold against intensity: 1 / C′.
float ashikhmin_threshold(float l) {
    if (l < 0.0034) {
        return 0.0014;
    }
    if (l < 1.0) {
        return 0.4027 * l;
    }
    if (l < 7.2444) {
        return 0.4027;
    }
    return 0.0556 * l;
}

// C(high) − C(low) of a whole picture. Of a picture of one luminance, `low` is taken as 0.
float ashikhmin_range(float low, float high) {
    return ashikhmin_steps(high > low ? low : 0.0, high);
}

// TM. `range`: ashikhmin_range(low, high).
float ashikhmin_curve(float l, float low, float high, float range, float display) {
    low = high > low ? low : 0.0;
    float steps = ashikhmin_steps(min(l, low), max(l, low));
    return high > 0.0 ? display * (l < low ? -steps : steps) / range : 0.0;
}

// L_d.
float ashikhmin_display(float l, float adaptation, float low, float high, float range, float display) {
    float mapped = ashikhmin_curve(adaptation, low, high, range, display);
    return mapped + ashikhmin_threshold(mapped) / ashikhmin_threshold(adaptation) * (l - adaptation);
}
