// The ray interface: nearest and any hit of the resident scene (lucerna::rays). Bindings 40 to 55 are its own; it also uses
// those of lib/material.glsl. Args take the fields of RayHandles of the same names.
#ifndef LIB_TRACE
#define LIB_TRACE
#include "lib/trace_common.glsl"
#ifdef TRACE_QUERY
#include "lib/trace_query.glsl"
#else
#include "lib/trace_compute.glsl"
#endif

// The nearest hit. `salt` decides where blended surfaces are there.
Hit trace_closest(Ray ray, uint mask, uint salt) {
    return trace(ray, mask, salt, false);
}

// Whether anything lies in the ray's segment.
bool trace_any(Ray ray, uint mask, uint salt) {
    return trace(ray, mask, salt, true).instance != NONE;
}

#endif
