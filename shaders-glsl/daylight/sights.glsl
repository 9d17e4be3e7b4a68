// Rays to the sun from many places at all times, one time after the other: the triangle that hid the sun at one time often saves the ray at the next.
// Before including: lib/trace.glsl, daylight/daylight.glsl, daylight/sun_ray.glsl, daylight/occluder.glsl; the blocks `settings`, `suns` and `bits`.

// After so many turns, invocations whose ray has ended start their next one.
const uint SIGHT_TURNS = 8u;

// The words of this invocation. Rows of groups share the words between them; `first`, `count`: the times of this dispatch.
uint first_word, end_word;

// Returns whether there are any.
bool find_words(uint first, uint count) {
    uint row = gl_WorkGroupID.y, rows = gl_NumWorkGroups.y;
    first_word = max(row * settings.words / rows, first / DAY_TIMES);
    end_word = min((row + 1u) * settings.words / rows, (first + count + DAY_TIMES - 1u) / DAY_TIMES);
    return first_word < end_word;
}

// The times of a word that belong to this dispatch: from x to before y.
uvec2 word_times(uint word, uint first, uint count) {
    return uvec2(max(DAY_TIMES * word, first), min(min(DAY_TIMES * (word + 1u), first + count), settings.times));
}

// The place from which an invocation sends rays now, and the times of one word. A word has the bits of the times at which the place wants rays, and
// then of those at which it sees the sun.
struct SunSight {
    uint word;    // in `bits`; NONE: there is no place
    uint begin;   // time of the first bit of the word
    vec3 position;
    vec2 disc;    // place on the disc of the sun
    uint salt;
    uint wanted;  // times at which rays are still wanted
    uint seen;    // times at which the sun is seen
    uint time;    // of the current ray
    DayOccluder occluder;  // as seen from the place
};

// Defined by the shader: goes on to the next word of an invocation, and to the next place with another occluder. Returns whether there is one.
bool next_word(inout SunSight sight);

// Goes on to the next ray that no known triangle hides. Returns whether there is one.
bool next_sight(inout SunSight sight, uint first, uint count, out DaySunRay ray) {
    while (true) {
        if (sight.wanted == 0u) {
            if (sight.word != NONE) bits[sight.word] = sight.seen;
            if (!next_word(sight)) return false;
            uvec2 times = word_times(sight.begin / DAY_TIMES, first, count) - sight.begin;
            uint word = bits[sight.word], now = bitfieldInsert(0u, ~0u, int(times.x), int(times.y - times.x));
            sight.wanted = word & now;
            sight.seen = word & ~now;
        } else {
            sight.time = uint(findLSB(sight.wanted));
            sight.wanted &= sight.wanted - 1u;
            ray = day_sun_ray(sight.position, suns[sight.begin + sight.time], sight.disc);
            if (!is_hidden(sight.occluder, ray)) return true;
        }
    }
}

// Sends the rays of all places of an invocation. Rays have different lengths, so invocations of a group go on to their next ray at different turns.
void send_sights(uint first, uint count) {
    SunSight sight;
    sight.word = NONE;
    sight.wanted = sight.seen = sight.time = 0u;
    DaySunRay ray;
    Traversal t;
    bool done = true;
    while (true) {
        if (done) {
            if (!next_sight(sight, first, count, ray)) break;
            t = trace_begin(Ray(sight.position, 0.0, ray.direction, ray.far), TRACE_SHADOW, sight.salt);
        }
        for (uint turn = 0u; turn < SIGHT_TURNS && !t.done; ++turn) trace_step(t, true);
        done = t.done;
        if (done) {
            Hit hit = trace_end(t);
            if (hit.instance == NONE) sight.seen |= 1u << sight.time;
            else sight.occluder = occluder_of(hit.instance, hit.triangle, sight.position);
        }
    }
}
