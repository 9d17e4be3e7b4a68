// Writes the depth of the draw where the map says important. Unimportant pixels keep what the depth was cleared to; not
// writing gl_FragDepth leaves the driver its coarse depth.
#version 460

layout(binding = 0) uniform sampler2D importance;

void main() {
    if (texelFetch(importance, ivec2(gl_FragCoord.xy), 0).r == 0.0) discard;
}
