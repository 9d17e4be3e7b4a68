//! Visibility of virtual lights by shadow maps instead of rays.
//!
//! Each virtual light has three maps ([`consts::VPL_MAPS`]), drawn by the rasteriser from where the light stands, which only the device
//! knows. Maps are drawn for as many lights at once as [`MOST_BYTES`] holds; what they hide is summed, and the next lights take their
//! place. Paraboloid maps (Brabec et al. 2002) need one or two maps a light and bend edges, so that a wall of two triangles would end up
//! somewhere else; imperfect shadow maps (Ritschel et al. 2008) need points on all surfaces. Three flat views hold the hemisphere, too.

use super::{Igi, Settings, Shared, Vpls, rays};
use crate::{
    Error, Result,
    graph::{Depth, Draw, Extent, Format, Graph, Image, ImageDesc, IndexedCall, Raster, Targets},
    passes::gbuffer::GBuffer,
    scene::resident::{Batches, Cutout, Handles},
    shaders::{
        consts::VPL_MAPS,
        igi::{gather_raster, raster as opaque, raster_cutout as cutout},
    },
};
use glam::Vec3;
use std::sync::Arc;

/// Bytes of all maps that are there at once.
const MOST_BYTES: u64 = 384 << 20;
/// Virtual lights of a frame: each takes three passes over the scene.
pub const MOST_LIGHTS: u32 = 2048;
/// Draws of a frame into maps: seconds of recording.
const MOST_DRAWS: u64 = 10_000_000;
/// Factor on a caster's own slope that it moves away by: the four texels around a place lie within one texel of it in both axes.
const SLOPE: f32 = 2.0;
/// Nearest depth of a map, of the scene's diagonal. Depth of a triangle that reaches from there to the far end is interpolated to within
/// a few ten-thousandths there.
const NEAREST: f32 = 2e-4;

/// Refuses what maps cannot serve, beside more than [`MOST_LIGHTS`].
pub(super) fn validate(settings: &Settings) -> Result<()> {
    if settings.imperfect {
        let what = "boxes of triangles need rays, and visibility is \"raster\"";
        return Err(Error::usage(what).at("imperfect").help("Choose imperfect = false or visibility = \"compute\""));
    }
    Ok(())
}

/// Refuses what would take minutes to record and gigabytes to hold: every primitive is drawn into three maps of every light, lit or not,
/// for how many paths met nothing only the device knows.
///
/// # Errors
/// `Usage`, naming both numbers.
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
        "{lights} virtual lights take {} draws with visibility = \"raster\", for the scene has {calls}; allowed: {MOST_DRAWS}",
        each * u64::from(lights)
    );
    let help = match MOST_DRAWS / each {
        0 => "Choose visibility = \"compute\"".to_owned(),
        most => format!("Choose vpls = {most}, or visibility = \"compute\""),
    };
    Err(Error::usage(what).at("vpls").help(help))
}

/// Lights whose maps of `size`² are there at once: a multiple of `subsets`, whatever fits.
fn at_once(size: u32, layers: u32, subsets: u32) -> u32 {
    let each = u64::from(VPL_MAPS) * u64::from(size) * u64::from(size) * 4;
    let most = (MOST_BYTES / each).min(u64::from(layers / VPL_MAPS)) as u32;
    (most / subsets * subsets).max(subsets)
}

/// Passes for `lights` virtual lights on a device whose images have `layers` layers at most. `holed`: some things have holes, which take a
/// pass of their own.
pub(super) fn passes(settings: &Settings, lights: u32, layers: u32, holed: bool) -> u64 {
    let batch = at_once(settings.raster_size, layers, settings.interleave * settings.interleave);
    u64::from(lights * VPL_MAPS * (1 + u32::from(holed)) + lights.div_ceil(batch))
}

impl Igi {
    /// Irradiance from the virtual lights at the visible surfaces, hidden by what their maps show.
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
        // A texel to clear, or a triangle to set up, takes about as long as a ray.
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
            graph.compute(args, extent).rays(rays(extent, count));
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
        // One of each subset even where that is more than was meant.
        assert_eq!(at_once(2048, 2048, 16), 16);
    }

    #[test]
    fn more_draws_than_a_frame_can_hold_are_refused() {
        few_draws(1000, 2048).unwrap();
        let error = few_draws(5000, 2048).unwrap_err();
        for part in ["vpls", "2048 virtual lights take 30720000 draws", "has 5000", "10000000", "vpls = 666"] {
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
