//! Visibility of virtual lights by shadow maps instead of rays.
//!
//! Each virtual light has three maps ([`consts::VPL_MAPS`]) with planar projections, which together cover its hemisphere. The rasteriser
//! draws them from the light's position, which only the device knows. [`MOST_BYTES`] limits the number of lights whose maps are in memory
//! at one time: a batch of lights is drawn and gathered, then the next batch reuses the maps.
//!
//! Paraboloid maps (Brabec et al. 2002) need one or two maps per light, but bend straight edges, so that a wall of two triangles would be
//! displaced. Imperfect shadow maps (Ritschel et al. 2008) need points on all surfaces.

use super::{Igi, Settings, Shared, Vpls};
use crate::{
    Error, Result,
    graph::{Depth, Draw, Extent, Format, Graph, Image, ImageDesc, IndexedCall, Raster, Targets},
    passes::gbuffer::GBuffer,
    resident::{Batches, Cutout, Handles},
    shaders::{
        consts::VPL_MAPS,
        igi::{gather_raster, raster as opaque, raster_cutout as cutout},
    },
};
use glam::Vec3;
use std::sync::Arc;

/// Maximum of bytes of all maps in memory.
const MOST_BYTES: u64 = 384 << 20;
/// Maximum of virtual lights per frame: each needs three passes over the scene.
pub const MOST_LIGHTS: u32 = 2048;
/// Maximum of draws into maps per frame. The host takes seconds to record them.
const MOST_DRAWS: u64 = 10_000_000;
/// Slope-scaled depth bias. The lookup reads four texels, each at most one texel away along both axes, so twice the slope covers them.
const SLOPE: f32 = 2.0;
/// Near plane of a map, as share of the scene's diagonal. With this value the depth of a triangle that spans the whole scene is
/// interpolated to within a few 10⁻⁴.
const NEAREST: f32 = 2e-4;

/// Refuses settings that shadow maps do not support. The caller checks [`MOST_LIGHTS`].
///
/// # Errors
/// `Usage`, naming the key.
pub(super) fn validate(settings: &Settings) -> Result<()> {
    if settings.imperfect {
        let what = "imperfect visibility needs shadow rays, but visibility is \"raster\"";
        return Err(Error::usage(what).at("imperfect").help("Choose imperfect = false or visibility = \"compute\""));
    }
    Ok(())
}

/// Refuses frames with more than [`MOST_DRAWS`] draws, which would take minutes to record and gigabytes of memory. Every primitive is
/// drawn into three maps for every light. The host cannot skip lights without flux, because only the device knows them.
///
/// # Errors
/// `Usage`, naming the number of lights and of draws.
pub(super) fn affordable(handles: &Handles, settings: &Settings) -> Result<()> {
    let calls = Batches::of_casters(&handles.moment, None, Vec3::ZERO).list.iter().map(|batch| batch.calls.len()).sum();
    few_draws(calls, settings.paths() * settings.bounces)
}

fn few_draws(calls: usize, lights: u32) -> Result<()> {
    let each = calls as u64 * u64::from(VPL_MAPS);
    if each * u64::from(lights) <= MOST_DRAWS {
        return Ok(());
    }
    let what = format!(
        "{lights} virtual lights take {} draws with visibility = \"raster\", because the scene has {calls} draws; allowed: {MOST_DRAWS}",
        each * u64::from(lights)
    );
    let help = match MOST_DRAWS / each {
        0 => "Choose visibility = \"compute\"".to_owned(),
        most => format!("Choose vpls = {most}, or visibility = \"compute\""),
    };
    Err(Error::usage(what).at("vpls").help(help))
}

/// Number of lights whose maps of `size`² texels are in memory at one time. It is a multiple of `subsets` and at least `subsets`, even if
/// this exceeds [`MOST_BYTES`].
fn at_once(size: u32, layers: u32, subsets: u32) -> u32 {
    let each = u64::from(VPL_MAPS) * u64::from(size) * u64::from(size) * 4;
    let most = (MOST_BYTES / each).min(u64::from(layers / VPL_MAPS)) as u32;
    (most / subsets * subsets).max(subsets)
}

impl Igi {
    /// Irradiance of every [`Settings::downsample`]-th pixel from the virtual lights, W/m², with visibility from shadow maps; alpha: number
    /// of map lookups.
    pub(super) fn gather_raster(
        &self,
        graph: &mut Graph,
        handles: &Handles,
        g: &GBuffer,
        shared: &Shared,
        vpls: Vpls,
        settings: &Settings,
    ) -> Image {
        let extent = graph.extent(g.depth).div_ceil(settings.downsample);
        let irradiance = graph.image("igi.irradiance", Format::RGBA32F, extent);
        graph.clear(irradiance, [0.0; 4]);
        let subsets = settings.interleave * settings.interleave;
        let size = settings.raster_size;
        let batch = at_once(size, self.most_layers, subsets).min(vpls.count.next_multiple_of(subsets));
        let desc = ImageDesc::new(Format::D32F, Extent::square(size)).layers(batch * VPL_MAPS);
        let maps = graph.image_with("igi.maps", desc);
        let batches = Batches::of_casters(&handles.moment, None, Vec3::ZERO);
        let visible = batches.visible_buffer(graph, "igi.casters");
        let calls = |holed: bool| -> Arc<[IndexedCall]> {
            let of = batches.list.iter().filter(|b| (b.cutout != Cutout::Opaque) == holed);
            of.flat_map(|b| b.calls.iter().copied()).collect()
        };
        let (solid, holed) = (calls(false), calls(true));
        // For the runner's time estimate: clearing a texel or setting up a triangle takes about as long as tracing a ray.
        let work = |calls: &[IndexedCall]| {
            let triangles = calls.iter().map(|call| u64::from(call.indices / 3) * u64::from(call.instances));
            triangles.sum::<u64>() + u64::from(size) * u64::from(size)
        };
        let (solid_work, holed_work) = (work(&solid), work(&holed));
        let nearest = (NEAREST * shared.diagonal).max(f32::MIN_POSITIVE);
        let state = Raster::new().depth_bias(0.0, -SLOPE);
        for first in (0..vpls.count).step_by(batch as usize) {
            let count = batch.min(vpls.count - first);
            for map in 0..count * VPL_MAPS {
                let (light, face) = (first + map / VPL_MAPS, map % VPL_MAPS);
                let targets = |load| Targets::new().depth(maps.layer(map), load);
                let args = opaque::Args {
                    instances: handles.instances,
                    visible,
                    positions: handles.positions,
                    vpls: vpls.buffer,
                    push: opaque::Push { light, face, nearest },
                };
                let draw = Draw::indexed(handles.indices, Arc::clone(&solid));
                graph.raster(targets(Depth::Clear(0.0)), state, args, draw).rays(solid_work);
                if holed.is_empty() {
                    continue;
                }
                let args = cutout::Args {
                    instances: handles.instances,
                    visible,
                    positions: handles.positions,
                    vpls: vpls.buffer,
                    uvs: handles.uvs,
                    colors: handles.colors,
                    materials: handles.materials,
                    scene_textures: handles.textures,
                    push: cutout::Push { light, face, nearest, seed: shared.seed },
                };
                let draw = Draw::indexed(handles.indices, Arc::clone(&holed));
                graph.raster(targets(Depth::Keep), state, args, draw).rays(holed_work);
            }
            let args = gather_raster::Args {
                view: g.view,
                normal: g.normal,
                depth: g.depth,
                vpls: vpls.buffer,
                irradiance,
                maps: maps.nearest(),
                push: gather_raster::Push {
                    first,
                    count,
                    tile: settings.interleave,
                    factor: settings.downsample,
                    scattered: settings.scattered.into(),
                    least: shared.least,
                    stride: settings.stride(),
                    seed: shared.seed,
                    nearest,
                },
            };
            graph.compute(args, extent).rays(extent.pixels() * u64::from(count));
        }
        irradiance
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::techniques::igi::Visibility;

    #[test]
    fn as_many_lights_at_once_as_fit() {
        assert_eq!(at_once(256, 2048, 1), 512);
        assert_eq!(at_once(64, 2048, 1), 682);
        assert_eq!(at_once(256, 2048, 9), 504);
        // Each subset needs one light, even if the maps then exceed the limit.
        assert_eq!(at_once(2048, 2048, 16), 16);
    }

    #[test]
    fn more_draws_than_a_frame_can_hold_are_refused() {
        few_draws(1000, 2048).unwrap();
        let error = few_draws(5000, 2048).unwrap_err();
        for part in ["vpls", "2048 virtual lights take 30720000 draws", "has 5000 draws", "10000000", "vpls = 666"] {
            assert!(error.to_string().contains(part), "{error}");
        }
        assert!(error.exit_code() == 2 && few_draws(4_000_000, 1).unwrap_err().to_string().contains("compute"));
    }

    #[test]
    fn too_many_lights_and_boxes_are_refused_by_name() {
        let raster = Settings { visibility: Visibility::Raster, ..Settings::default() };
        raster.validate().unwrap();
        let error = Settings { vpls: 2049, bounces: 1, ..raster.clone() }.validate().unwrap_err().to_string();
        assert!(error.contains("vpls: 2049") && error.contains("1 to 2048"), "{error}");
        let error = Settings { imperfect: true, ..raster }.validate().unwrap_err();
        assert!(error.exit_code() == 2 && error.to_string().contains("imperfect"), "{error}");
    }
}
