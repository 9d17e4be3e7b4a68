//! The layers of a picture from the G-buffer, which all techniques have in common.

use glam::{Vec2, Vec3};
use lucerna::{passes::gbuffer::GBuffer, scene::View};

use crate::frame_output::FrameOutput;

/// Depth of the background, metres; the value that Blender writes.
const BACKGROUND: f32 = 1e10;

/// Adds `albedo`, `normal` (world space) and `depth` (distance along the line of sight, metres).
pub fn add(output: FrameOutput, gbuffer: &GBuffer, view: &View) -> FrameOutput {
    let far = view.far;
    output
        .color("albedo", gbuffer.albedo)
        .layer("normal", &["X", "Y", "Z"], gbuffer.normal, |texel| decode_normal(texel).extend(0.0).to_array())
        .layer("depth", &["Z"], gbuffer.depth, move |[z, ..]| {
            [if z < 1.0 { z * far } else { BACKGROUND }, 0.0, 0.0, 0.0]
        })
}

/// Decodes a normal as in `lib/gbuffer.glsl`: octahedral if alpha is 1, else one byte per component.
fn decode_normal([x, y, z, a]: [f32; 4]) -> Vec3 {
    if a <= 0.5 {
        return (Vec3::new(x, y, z) * 2.0 - 1.0).normalize_or_zero();
    }
    let p = Vec2::new(x, y) * 2.0 - 1.0;
    let z = 1.0 - p.x.abs() - p.y.abs();
    let fold = (-z).max(0.0);
    Vec3::new(p.x - fold.copysign(p.x), p.y - fold.copysign(p.y), z).normalize_or_zero()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_come_back_from_both_encodings() {
        for n in [Vec3::X, Vec3::NEG_Y, Vec3::NEG_Z, Vec3::new(0.6, 0.0, -0.8), Vec3::new(-0.48, 0.6, 0.64)] {
            let bytes = (n + 1.0) * 0.5;
            assert!((decode_normal([bytes.x, bytes.y, bytes.z, 0.0]) - n).length() < 1e-5, "{n}");
            let p = n.truncate() / (n.x.abs() + n.y.abs() + n.z.abs());
            let sign = |x: f32| if x >= 0.0 { 1.0 } else { -1.0 };
            let folded = Vec2::new((1.0 - p.y.abs()) * sign(p.x), (1.0 - p.x.abs()) * sign(p.y));
            let code = (if n.z >= 0.0 { p } else { folded }) * 0.5 + 0.5;
            assert!((decode_normal([code.x, code.y, 0.0, 1.0]) - n).length() < 1e-5, "{n}");
        }
    }
}
