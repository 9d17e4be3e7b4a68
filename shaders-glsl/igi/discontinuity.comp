// The discontinuity buffer: mean irradiance of the tile around a texel, over texels on the same surface (Wald et al. 2002; Marques and
// Santos, section 4.3). Each texel of the tile has gathered from another subset of the virtual lights.
#version 460
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2D guide; // from igi/guide.comp
layout(binding = 1) uniform sampler2D interleaved;
layout(binding = 2, rgba32f) uniform writeonly image2D irradiance;

layout(push_constant, scalar) uniform Push {
    uint tile;      // texels along the side of a tile
    float nearness; // maximum difference in depth, relative to the texel's depth
    float likeness; // minimum cosine between normals
};

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = textureSize(interleaved, 0);
    if (any(greaterThanEqual(texel, size))) return;
    vec4 own = texelFetch(guide, texel, 0);
    float z = own.w;
    if (z >= 1.0) {
        imageStore(irradiance, texel, vec4(0.0));
        return;
    }
    vec4 sum = vec4(0.0);
    float count = 0.0;
    // The window has the size of a tile, so that it contains each subset once.
    int from = -(int(tile) - 1) / 2, to = int(tile) / 2;
    for (int y = from; y <= to; ++y) {
        for (int x = from; x <= to; ++x) {
            ivec2 other = texel + ivec2(x, y);
            if (any(lessThan(other, ivec2(0))) || any(greaterThanEqual(other, size))) continue;
            vec4 there = texelFetch(guide, other, 0);
            if (there.w >= 1.0 || abs(there.w - z) > nearness * z || dot(own.xyz, there.xyz) < likeness) continue;
            sum += texelFetch(interleaved, other, 0);
            count += 1.0;
        }
    }
    // Rounding of the texel's normal may reject the texel itself, so the count may be 0.
    imageStore(irradiance, texel, count > 0.0 ? sum / count : texelFetch(interleaved, texel, 0));
}
