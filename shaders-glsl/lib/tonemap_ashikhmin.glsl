// Ashikhmin 2002, as restated by Michael 2010, section 4.3. Luminances in cd/m².

// Perceptual capacity C: just noticeable differences below a luminance.
float ashikhmin_capacity(float l) {
    if (l < 0.0034) {
        return l / 0.0014;
    }
    if (l < 1.0) {
        return 2.4483 + log(l / 0.0034) / 0.4027;
    }
    if (l < 7.2444) {
        return 16.5630 + (l - 1.0) / 0.4027;
    }
    return 32.0693 + log(l / 7.2444) / 0.0556;
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

// TM. Of a picture of one luminance, `low` is taken as 0.
float ashikhmin_curve(float l, float low, float high, float display) {
    float top = ashikhmin_capacity(high);
    float bottom = ashikhmin_capacity(low);
    if (!(top > bottom)) {
        bottom = 0.0;
    }
    return top > 0.0 ? display * (ashikhmin_capacity(l) - bottom) / (top - bottom) : 0.0;
}

// L_d.
float ashikhmin_display(float l, float adaptation, float low, float high, float display) {
    float mapped = ashikhmin_curve(adaptation, low, high, display);
    return mapped + ashikhmin_threshold(mapped) / ashikhmin_threshold(adaptation) * (l - adaptation);
}
