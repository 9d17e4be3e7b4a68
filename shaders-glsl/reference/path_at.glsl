// The states of paths by their address. Before including: reference/path.glsl and `settings`.
#ifndef LIB_PATH_AT
#define LIB_PATH_AT
#include "lib/scene_at.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 4) buffer PathsAt { PathState of[]; };
#define PATH_AT(i) PathsAt(settings.paths_at).of[i]

#endif
