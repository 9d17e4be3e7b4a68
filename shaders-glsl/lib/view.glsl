// The camera of a frame. Right-handed, +Y up, looking down -Z; clip space has +Y up and reversed depth (1 near, 0 far).
#ifndef LIB_VIEW
#define LIB_VIEW

struct View {
    mat4 view_from_world;
    mat4 clip_from_view;
    mat4 clip_from_world;
    vec3 position;      // of the camera, metres
    float far;          // metres along the view axis at which linear depth is 1
    // A pixel at uv (0..1, y down) and linear depth z (eye distance / far) lies at
    // (base_o + x base_u + y base_v) + (frustum_o + x frustum_u + y frustum_v) z.
    vec3 frustum_o;     // camera to the top left corner of the far plane (perspective); axis * far (orthographic)
    float near;         // metres
    vec3 frustum_u;     // along the top edge of the far plane to the right; zero for orthographic cameras
    uint orthographic;  // 1: rays are parallel
    vec3 frustum_v;     // along the left edge of the far plane downwards; zero for orthographic cameras
    vec3 base_o;        // the camera (perspective); top left corner of the plane through the camera (orthographic)
    float pixel_angle;  // size of a pixel: metres per metre of depth (perspective), metres (orthographic)
    vec3 base_u;        // zero for perspective cameras
    vec3 base_v;        // zero for perspective cameras
    vec2 extent;        // pixels
};

// Origin of the ray through uv (x to the right, y down, both 0..1 at the borders of the image).
vec3 view_base(View view, vec2 uv) {
    return view.base_o + uv.x * view.base_u + uv.y * view.base_v;
}

// From the base to the far plane through uv; not normalised.
vec3 view_ray(View view, vec2 uv) {
    return view.frustum_o + uv.x * view.frustum_u + uv.y * view.frustum_v;
}

// World position of linear depth z at uv; no matrix (ISR dissertation, section 4.3).
vec3 world_from_depth(View view, vec2 uv, float z) {
    return view_base(view, uv) + view_ray(view, uv) * z;
}

// Unit vector from a world position towards the camera.
vec3 to_camera(View view, vec3 world) {
    return view.orthographic != 0u ? -normalize(view.frustum_o) : normalize(view.position - world);
}

// Linear depth (eye distance / far) of a world position.
float depth_of(View view, vec3 world) {
    return -(view.view_from_world * vec4(world, 1.0)).z / view.far;
}

// uv of a world position in front of the camera.
vec2 uv_of(View view, vec3 world) {
    vec4 clip = view.clip_from_world * vec4(world, 1.0);
    return vec2(0.5, 0.5) + vec2(0.5, -0.5) * clip.xy / clip.w;
}

#endif
