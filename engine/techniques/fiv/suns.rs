//! Separated texels: small bright lights that the vectors do not contain.
//!
//! The shadow of a one-texel light has a hard edge. Interpolation between samples makes the edge as wide as the
//! distance of the samples. If an occluder only moves, its shadow for one direction depends on two coordinates across
//! this direction. A shadow map for this direction therefore gives the shadow up to the resolution of the map. Several
//! occluders hide such a light once, without an estimate of their overlap.

use glam::{DVec2, Vec3};

use super::{
    cover::Cover,
    light::Light,
    occluder::Occluder,
    sky::{self, Sky},
};
use crate::{
    Error, ErrorKind, Result,
    gpu::{Gpu, OwnedBuffer},
    graph::Runner,
    shaders::{consts::FIV_SUN_SIDE, types},
};

/// Most texels that can be separated.
pub const MOST: u32 = 16;
/// Floats of a shadow map.
pub const FLOATS: u32 = FIV_SUN_SIDE * FIV_SUN_SIDE;

/// The separated texels in the form that shaders read.
pub fn of(sky: &Sky) -> Vec<types::FivSun> {
    let sun = |sun: &sky::Sun| {
        let (face, x, y) = sky::place(sky.size, sun.texel);
        let st = (DVec2::new(x.into(), y.into()) + 0.5) / f64::from(sky.size);
        let direction = sky::direction(face, st).normalize().as_vec3();
        let right = direction.any_orthonormal_vector();
        types::FivSun {
            radiance: sun.radiance.to_array(),
            area: sky::area(face, sky.size, x, y).as_vec3().to_array(),
            direction: direction.to_array(),
            right: right.to_array(),
            up: direction.cross(right).to_array(),
        }
    };
    sky.suns.iter().map(sun).collect()
}

/// The shadow maps of all kinds, those of one kind next to each other. Each entry is the extent of the kind towards the
/// light, metres from its centre.
///
/// # Errors
/// `Runtime` if they or an occluder are larger than the device's limits; `OutOfMemory`, `DeviceLost`.
pub fn maps(gpu: &Gpu, light: &Light, kinds: &[Occluder]) -> Result<OwnedBuffer> {
    let bytes = 4 * u64::from(FLOATS) * light.suns.len() as u64 * kinds.len() as u64;
    let limit = gpu.caps().limits.storage_range;
    if bytes > limit {
        let what = format!("the shadow maps of separated texels have {bytes} bytes; the device allows {limit}");
        return Err(Error::new(ErrorKind::Runtime, what).at("fiv.suns").help("Separate fewer texels"));
    }
    let mut all: Vec<f32> = Vec::new();
    let mut runner = Runner::new(gpu);
    for kind in kinds.iter().filter(|_| !light.suns.is_empty()) {
        let mut cover = Cover::new(gpu, kind)?;
        for sun in &light.suns {
            all.extend(cover.run_map(&mut runner, [sun.direction, sun.right, sun.up].map(Vec3::from))?);
        }
    }
    all.resize(all.len().max(1), 0.0);
    OwnedBuffer::with_contents(gpu, "fiv.suns", bytemuck::cast_slice(&all))
}
