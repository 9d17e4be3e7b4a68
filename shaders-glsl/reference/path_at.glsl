// The states of paths, their hits and their lists by address. Before including: reference/path.glsl, lib/ray.glsl and `settings`.
#ifndef LIB_PATH_AT
#define LIB_PATH_AT
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

layout(buffer_reference, scalar, buffer_reference_align = 4) buffer PathsAt { PathState of[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer HitsAt { Hit of[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer ListsAt { uint of[]; };
#define PATH_AT(i) PathsAt(settings.paths_at).of[i]
#define HIT_AT(i) HitsAt(settings.hits_at).of[i]
#define LIST_AT(i) ListsAt(settings.lists_at).of[i]

#endif
