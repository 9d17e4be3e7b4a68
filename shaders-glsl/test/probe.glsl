const uint MAX_PROBES = 4u; // export
struct Probe { vec3 at; float weight; mat4 m; uint flags[2]; };
