// Views beside the frame's from which surfaces send light (techniques::isr::senders). Include lib/view.glsl, lib/screen.glsl and
// isr/isr.glsl before.

// A view whose buffers are layer number (its own number) of the array images.
struct SenderView {
    View view;
    float hole;  // half width of the square in the middle, as share of the picture's, in which no samples are taken
};

// Distance from the plane of a texel, relative to the depth, and cosine of the normals, up to which a point lies on its surface.
const float ISR_SAME_PLANE = 0.02;
const float ISR_SAME_NORMAL = 0.3;

// Least cosine that isr_footprint() takes a surface to be seen at.
const float ISR_GRAZING = 0.05;

// The texel of a view of `extent` texels in which the point lies; x < 0: it is not in the picture.
ivec2 isr_texel(View view, ivec2 extent, vec3 x) {
    float z = depth_of(view, x);
    vec2 uv = uv_of(view, x);
    bool inside = z > 0.0 && z < 1.0 && all(greaterThanEqual(uv, vec2(0.0))) && all(lessThan(uv, vec2(1.0)));
    return inside ? min(ivec2(uv * vec2(extent)), extent - 1) : ivec2(-1);
}

// Is the point x with unit normal xn on the surface that a texel shows: depth `texel_z`, any normal `texel_normal`?
bool isr_shows(View view, ivec2 texel, float factor, float texel_z, vec3 texel_normal, vec3 x, vec3 xn) {
    if (texel_z >= 1.0 || dot(texel_normal, xn) < ISR_SAME_NORMAL * length(texel_normal)) {
        return false;
    }
    vec3 at = screen_position(view, texel, factor, texel_z);
    return abs(dot(xn, at - x)) < ISR_SAME_PLANE * texel_z * view.far;
}

// Is a point hidden behind what a texel shows, a surface of `thickness` relative to its depth?
bool isr_behind(float z, float texel_z, float thickness) {
    return texel_z < z * 0.98 && texel_z > z * (0.98 - thickness);
}

// Place in a view (-1..1) of (a, b) in [0, 1)²: even over the picture but for the hole.
vec2 isr_around(vec2 ab, float hole) {
    return isr_rim(ab.y) * sqrt(mix(hole * hole, 1.0, ab.x));
}
