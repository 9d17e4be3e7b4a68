//! The mesh-building kit of the built-in scenes: solids, surfaces of revolution, sweeps, terrain, textures, sky.
//!
//! Everything here is metres, Y up, counter-clockwise seen from outside. Texture coordinates are metres of surface (so
//! that a material says how large its texture is), v grows downwards as in glTF.

mod curves;
mod geometry;
mod mouldings;
mod nets;
mod pictures;
mod plants;
mod random;
mod sky;
mod soft;
mod solids;
mod stage;
mod surfaces;
mod tableware;

pub(crate) use curves::{curve, profile};
#[cfg(test)]
pub(crate) use geometry::place;
pub(crate) use geometry::{Geometry, Model};
pub(crate) use mouldings::{moulding, picture_frame};
pub(crate) use nets::{blend, blend_max, polygon_distance, round_cone, shrink_wrap, surface_net};
pub(crate) use pictures::{Picture, bricks, carpet, checker, lettering, mottled, planks, veneer};
pub(crate) use plants::{fern, tree};
pub(crate) use random::{Random, fbm, hash, value_noise};
pub(crate) use sky::{GradientSky, uniform_environment};
pub(crate) use soft::{pillow, puffed, rounded_box};
pub(crate) use solids::{Opening, bevel_box, cuboid, slab, sphere, torus, wall};
pub(crate) use stage::{Stage, looking, trs};
pub(crate) use surfaces::{circle, cylinder, extrude, frustum, lathe, loop_sweep, sheet, sweep, terrain, tube};
pub(crate) use tableware::{cup, fruit_bowl, vessel};

use glam::{Mat4, Quat, Vec3};

/// Linear Rec. 709 of an sRGB colour `0xRRGGBB`.
pub(crate) fn srgb(hex: u32) -> Vec3 {
    let channel = |shift: u32| linear_from_srgb(((hex >> shift) & 255) as f32 / 255.0);
    Vec3::new(channel(16), channel(8), channel(0))
}

/// Inverse of the sRGB transfer function (IEC 61966-2-1), one channel in [0, 1].
pub(crate) fn linear_from_srgb(encoded: f32) -> f32 {
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// The sRGB transfer function (IEC 61966-2-1), one channel, clamped to [0, 1].
pub(crate) fn srgb_from_linear(linear: f32) -> f32 {
    let linear = linear.clamp(0.0, 1.0);
    if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// Turns by `degrees` about +Y (counter-clockwise seen from above), then moves to `position`.
pub(crate) fn placed(position: Vec3, degrees: f32) -> Mat4 {
    Mat4::from_rotation_translation(Quat::from_rotation_y(degrees.to_radians()), position)
}

/// Translation by (x, y, z).
pub(crate) fn at(x: f32, y: f32, z: f32) -> Mat4 {
    Mat4::from_translation(Vec3::new(x, y, z))
}
