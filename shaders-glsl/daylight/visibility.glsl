// At which times places see the sun: a bit for each time. The times of a place come one after the other: most often the triangle that hid the sun at one
// time hides it at the next time too, and saves its ray (the object that is tried first in Haines and Greenberg, "The Light Buffer", 1986).
// Before including: lib/trace.glsl, daylight/daylight.glsl, daylight/sun_ray.glsl, daylight/occluder.glsl; the blocks `settings`, `suns` and `bits`.

layout(push_constant, scalar) uniform Push {
    uint first;  // time of this dispatch
    uint count;
};

// Invocations whose ray has ended start their next one after so many turns of the rays of their group (Aila and Laine, "Understanding the Efficiency of
// Ray Traversal on GPUs", HPG 2009, replace rays in a similar way).
const uint VISIBILITY_TURNS = 8u; // export

// A place from which the sun may be seen.
struct SunPlace {
    uint first_word;  // in `bits`
    vec3 position;    // moved off its surface
    vec2 disc;        // as for day_sun_ray()
    uint salt;        // of its rays
};

// The shader defines both: the next place of this invocation, and false after the last one; and whether the current place wants a ray to a sun.
bool next_place(out SunPlace place);
bool wants_ray(SunPlace place, DaySun sun);

// Words of this invocation: rows of groups share the words of the times between them.
uint first_word, end_word;

// The current place of this invocation, its occluder, and its times.
SunPlace place;
DayOccluder occluder;
uint word;    // of the place; end_word: there is no place yet
uint wanted;  // times of the word at which rays are still wanted
uint seen;    // times of the word at which the sun is seen
uint time;    // of the ray, in the word

// Goes on to the next word, which may be that of the next place. Returns false after the last word of the last place.
bool next_word() {
    if (word + 1u < end_word) {
        ++word;
    } else {
        if (!next_place(place)) return false;
        word = first_word;
        occluder = no_occluder();
    }
    uint begin = max(DAY_TIMES * word, first), end = min(min(DAY_TIMES * (word + 1u), first + count), settings.times);
    for (uint t = begin; t < end; ++t) {
        if (wants_ray(place, suns[t])) wanted |= 1u << t % DAY_TIMES;
    }
    // Earlier dispatches found the earlier times of the word.
    seen = begin > DAY_TIMES * word ? bits[place.first_word + word] : 0u;
    return true;
}

// Goes on to the next ray that no known triangle hides, and stores the words before it. Returns false after the last ray.
bool next_ray(out DaySunRay ray) {
    while (true) {
        if (wanted == 0u) {
            if (word != end_word) bits[place.first_word + word] = seen;
            if (!next_word()) return false;
        } else {
            time = uint(findLSB(wanted));
            wanted &= wanted - 1u;
            ray = day_sun_ray(place.position, suns[DAY_TIMES * word + time], place.disc);
            if (!is_hidden(occluder, ray)) return true;
        }
    }
}

// Finds the bits of all places of this invocation.
void find_visibility() {
    uint row = gl_WorkGroupID.y, rows = gl_NumWorkGroups.y, words = day_words(settings);
    first_word = max(row * words / rows, first / DAY_TIMES);
    end_word = min((row + 1u) * words / rows, (first + count + DAY_TIMES - 1u) / DAY_TIMES);
    if (first_word >= end_word) return;
    // There is no place yet.
    word = end_word;
    wanted = seen = time = 0u;
    DaySunRay ray;
    Traversal t;
    bool done = true;
    while (true) {
        if (done) {
            if (!next_ray(ray)) break;
            t = trace_begin(Ray(place.position, 0.0, ray.direction, ray.far), TRACE_SHADOW, place.salt);
        }
        for (uint turn = 0u; turn < VISIBILITY_TURNS && !t.done; ++turn) trace_step(t, true);
        done = t.done;
        if (done) {
            Hit hit = trace_end(t);
            if (hit.instance == NONE) seen |= 1u << time;
            else occluder = occluder_of(hit.instance, hit.triangle, place.position);
        }
    }
}
