//! The layers of a picture from the G-buffer, which all techniques have in common.

use glam::{Vec2, Vec3};

use crate::{passes::gbuffer::GBuffer, scene::View};

use super::{Decode, picture::Layer};

/// Depth of the background, metres; the value that Blender writes.
const BACKGROUND: f32 = 1e10;

/// Adds `albedo`, `normal` (world space) and `depth` (distance along the line of sight, metres).
pub(super) fn add(layers: &mut Vec<Layer>, gbuffer: &GBuffer, view: &View) {
    layers.extend([
        Layer { name: "albedo", channels: &["R", "G", "B"], image: gbuffer.albedo, decode: Decode::Plain },
        Layer { name: "normal", channels: &["X", "Y", "Z"], image: gbuffer.normal, decode: Decode::Normal },
        Layer { name: "depth", channels: &["Z"], image: gbuffer.depth, decode: Decode::Depth { far: view.far } },
    ]);
}

impl Decode {
    /// The values of a pixel.
    pub(super) fn pixel(self, texel: [f32; 4]) -> [f32; 4] {
        match self {
            Self::Plain => texel,
            Self::Normal => normal(texel).extend(0.0).to_array(),
            Self::Depth { far } => [if texel[0] < 1.0 { texel[0] * far } else { BACKGROUND }, 0.0, 0.0, 0.0],
        }
    }
}

fn normal([x, y, z, a]: [f32; 4]) -> Vec3 {
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
            assert!((normal([bytes.x, bytes.y, bytes.z, 0.0]) - n).length() < 1e-5, "{n}");
            let p = n.truncate() / (n.x.abs() + n.y.abs() + n.z.abs());
            let sign = |x: f32| if x >= 0.0 { 1.0 } else { -1.0 };
            let folded = Vec2::new((1.0 - p.y.abs()) * sign(p.x), (1.0 - p.x.abs()) * sign(p.y));
            let code = (if n.z >= 0.0 { p } else { folded }) * 0.5 + 0.5;
            assert!((normal([code.x, code.y, 0.0, 1.0]) - n).length() < 1e-5, "{n}");
        }
    }

    #[test]
    fn the_background_lies_behind_everything() {
        let depth = Decode::Depth { far: 20.0 };
        assert_eq!(depth.pixel([0.25, 9.0, 9.0, 9.0]), [5.0, 0.0, 0.0, 0.0]);
        assert_eq!(depth.pixel([1.0; 4])[0], BACKGROUND);
        assert_eq!(Decode::Plain.pixel([1.0, -2.0, 3.0, 0.5]), [1.0, -2.0, 3.0, 0.5]);
    }
}
