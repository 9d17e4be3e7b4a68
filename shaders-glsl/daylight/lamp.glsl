// Light of one lamp at a point: a point or spot light, or a place on an emissive triangle, chosen by what each can send there.
// Before including: lib/lights.glsl, lib/light_sampling.glsl, lib/hit_surface.glsl, daylight/emission.glsl, and a buffer `groups` with the group of
// each light and then of each material.
#ifndef DAY_LAMP
#define DAY_LAMP

struct DayLamp {
    vec3 arrives;   // irradiance at normal incidence over the probability of the choice, W/m², without shadows
    vec3 to_light;  // unit
    vec3 target;    // end of the shadow ray
    uint group;     // of lamps; NONE: none
    bool punctual;  // a point or spot light
};

// A lamp for a surface at `point` whose front looks along the unit vector `normal`; for a point in space `normal` is 0. `punctual`: number of
// point and spot lights. False: nothing arrives.
bool day_lamp(vec3 point, vec3 normal, uvec4 hash, uint punctual, out DayLamp lamp) {
    vec2 u = unit_floats(hash.xy);
    float chosen;
    LightTarget to = LIGHT_TARGET(pick_light(point, normal, u.x, hash.zw, chosen));
    if (!(chosen > 0.0)) return false;
    lamp.punctual = to.instance == TARGET_PUNCTUAL;
    if (lamp.punctual) {
        Light one = light(to.index);
        lamp.arrives = light_irradiance(one, point, lamp.to_light) / chosen;
        lamp.target = one.position;
        lamp.group = groups[to.index];
    } else {
        SurfacePoint place = surface_point(to.instance, to.index, sample_triangle(u));
        uint material = INSTANCE_AT(to.instance).material;
        bool both = (MATERIAL_AT(material).flags & MATERIAL_DOUBLE_SIDED) != 0u;
        vec3 away = point - place.position;
        float facing = dot(place.area, away);
        float distance2 = dot(away, away);
        if (!(facing > 0.0 || (both && facing < 0.0)) || distance2 == 0.0) return false;
        lamp.to_light = -away * inversesqrt(distance2);
        // The length of `place.area` is twice the triangle's area.
        float angle = 0.5 * abs(facing) / (distance2 * sqrt(distance2));
        lamp.arrives = triangle_emission(to.instance, place) * (angle / chosen);
        lamp.target = place.position + place.area * (sign(facing) * surface_gap(place) / length(place.area));
        lamp.group = groups[punctual + material];
    }
    return lamp.group != NONE && lamp.arrives != vec3(0.0);
}

#endif
