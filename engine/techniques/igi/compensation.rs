//! Compensation of the bounded geometry term (Kollig and Keller 2004). The bound removes light that comes from virtual lights near
//! the receiver. Short rays, as long as the bound reaches, hit the near surfaces instead; their radiance is weighted by the share that
//! the bound removes. The light of virtual lights on these surfaces is bounded as well. The next segment of the short path
//! compensates this bound, up to the number of bounces.

use super::{Igi, LightTree, Settings, Shared, Vpls, dispatch, filters, gather::listed_groups};
use crate::{
    Error, Result,
    graph::{Buffer, Extent, Format, Graph, Image},
    passes::gbuffer::GBuffer,
    resident::Handles,
    shaders::{
        consts::TEXTURE_SLOTS,
        igi::{
            near_add, near_begin, near_begin_listed, near_begin_tree, near_direct, near_end, near_end_listed,
            near_end_tree, near_pick, near_trace,
        },
        types,
    },
};

/// Short paths that are in memory at one time.
const HELD: u32 = 1 << 18;
/// Maximum of passes of a picture. The host takes some seconds and a hundred megabytes to plan and record them.
const MOST_PASSES: u64 = 50_000;

/// A buffer of `paths` values of `types::NearPath`. They are zero until the paths begin.
fn held(graph: &mut Graph, paths: u32) -> Buffer {
    let near_paths = graph.buffer("igi.near", u64::from(paths.max(1)) * size_of::<types::NearPath>() as u64);
    graph.fill(near_paths, 0);
    near_paths
}

impl Igi {
    /// Number of passes of a picture of `extent` pixels for short paths and for ray trees; the other passes are few.
    fn many_passes(&self, extent: Extent, settings: &Settings) -> u64 {
        let trees = self.tree_ranges(extent, settings);
        let grown = trees * (1 + u64::from(settings.cache > 0.0)) * u64::from(settings.specular_depth + 1);
        if !(settings.indirect && settings.compensates()) {
            return grown;
        }
        let held = |extent: Extent| extent.pixels().div_ceil(HELD.into());
        let listed = if settings.refine > 0.0 && settings.upsamples() { held(extent) } else { 0 };
        let ranges = held(extent.div_ceil(settings.downsample)) + listed + trees;
        grown + ranges * (2 + u64::from(settings.compensation) * 3 * u64::from(settings.bounces))
    }

    /// Refuses pictures that would take more passes than a host can plan and record in seconds.
    ///
    /// # Errors
    /// `Usage`, naming the number of passes.
    pub(super) fn few_passes(&self, extent: Extent, settings: &Settings) -> Result<()> {
        let passes = self.many_passes(extent, settings);
        if passes <= MOST_PASSES {
            return Ok(());
        }
        let what = format!("a picture of {extent} pixels would need about {passes} passes; allowed: {MOST_PASSES}");
        let (key, less) = match settings.compensates() {
            true => ("igi.compensation", "Choose fewer, or a smaller picture"),
            false => ("igi.specular_depth", "Choose less, or a smaller picture"),
        };
        Err(Error::usage(what).at(key).help(less))
    }

    /// Adds the compensated light to the coarse irradiance, which has every [`Settings::downsample`]-th pixel. A filter removes the noise of this
    /// light ([`Settings::compensation_filter`]).
    #[allow(clippy::too_many_arguments)]
    pub(super) fn compensate(
        &self,
        graph: &mut Graph,
        handles: &Handles,
        g: &GBuffer,
        shared: &Shared,
        vpls: Vpls,
        settings: &Settings,
        irradiance: Image,
    ) {
        let Some(tree) = vpls.tree else { return };
        let extent = graph.extent(irradiance);
        let texels = extent.width * extent.height;
        let near_paths = held(graph, texels.min(HELD));
        let apart = settings.filters_compensation();
        let target = if apart { graph.image("igi.near_light", Format::RGBA32F, extent) } else { irradiance };
        if apart {
            // The last pass of the paths reads its image where it does not keep the light apart, so the image needs content.
            graph.clear(target, [0.0; 4]);
        }
        for first in (0..texels).step_by(HELD as usize) {
            let count = HELD.min(texels - first);
            for number in 0..settings.compensation {
                let push = near_begin::Push {
                    extent: [extent.width, extent.height],
                    first,
                    count,
                    number,
                    paths: settings.compensation,
                    factor: settings.downsample,
                    scattered: settings.scattered.into(),
                };
                let args = near_begin::Args { view: g.view, normal: g.normal, depth: g.depth, near_paths, push };
                graph.compute(args, count);
                self.follow(graph, handles, shared, (vpls, tree), settings, (near_paths, count, number, None));
            }
            let push = near_end::Push { first, count, paths: settings.compensation };
            let spec = near_end::Spec { apart: apart.into() };
            graph.compute(near_end::Args { irradiance: target, near_paths, push, spec }, count);
        }
        if apart {
            let light = filters::soft_light(graph, g, target, settings.compensation_filter, true);
            graph.compute(near_add::Args { light, irradiance }, extent);
        }
    }

    /// Adds the compensated light to the pixels of [`Igi::refine`], and dims specks among them ([`Settings::despeckle`]).
    pub(super) fn compensate_listed(
        &self,
        graph: &mut Graph,
        handles: &Handles,
        g: &GBuffer,
        shared: &Shared,
        (vpls, settings): (Vpls, &Settings),
        (irradiance, unmatched): (Image, Buffer),
    ) {
        let Some(tree) = vpls.tree else { return };
        let pixels = graph.extent(irradiance).pixels() as u32;
        let count = HELD.min(pixels);
        let near_paths = held(graph, count);
        let ranges = pixels.div_ceil(count.max(1));
        // The device computes the number of workgroups from the list's length, because most lists are short.
        let groups = listed_groups(graph, unmatched, count, ranges);
        for range in 0..ranges {
            let (first, groups) = (range * count, Some((groups, 12 * u64::from(range))));
            for number in 0..settings.compensation {
                let push = near_begin_listed::Push { first, count, number, paths: settings.compensation };
                let args = near_begin_listed::Args {
                    view: g.view,
                    normal: g.normal,
                    depth: g.depth,
                    unmatched,
                    near_paths,
                    push,
                };
                dispatch(graph, args, groups, count);
                self.follow(graph, handles, shared, (vpls, tree), settings, (near_paths, count, number, groups));
            }
            let push = near_end_listed::Push { first, count, limit: settings.despeckle };
            dispatch(graph, near_end_listed::Args { irradiance, unmatched, near_paths, push }, groups, count);
        }
    }

    /// Adds the compensated light to the ray tree nodes.
    pub(super) fn compensate_trees(
        &self,
        graph: &mut Graph,
        handles: &Handles,
        shared: &Shared,
        vpls: Vpls,
        settings: &Settings,
        (tree_nodes, count): (Buffer, u32),
    ) {
        let Some(tree) = vpls.tree else { return };
        let near_paths = held(graph, count);
        for number in 0..settings.compensation {
            let push = near_begin_tree::Push { count, number, paths: settings.compensation };
            graph.compute(near_begin_tree::Args { tree_nodes, near_paths, push }, count);
            self.follow(graph, handles, shared, (vpls, tree), settings, (near_paths, count, number, None));
        }
        let push = near_end_tree::Push { count };
        graph.compute(near_end_tree::Args { tree_nodes, near_paths, push }, count);
    }

    /// Traces short paths that have begun, and adds the light at their surfaces. `groups`: number of workgroups, where only the
    /// device knows it.
    fn follow(
        &self,
        graph: &mut Graph,
        handles: &Handles,
        shared: &Shared,
        (vpls, tree): (Vpls, LightTree),
        settings: &Settings,
        (near_paths, count, number, groups): (Buffer, u32, u32, Option<(Buffer, u64)>),
    ) {
        let (least, seed) = (shared.least, shared.seed);
        for turn in 0..settings.bounces {
            let diffuse_only = (!settings.specular).into();
            let push = near_trace::Push { count, turn, number, least, diffuse_only, slots: TEXTURE_SLOTS, seed };
            let args = crate::rays::traced!(near_trace::Args { near_paths, push }, shared.rays, handles);
            dispatch(graph, args, groups, count).rays(count.into());
            let push = near_direct::Push { count, turn, number };
            let args = traced_lit!(near_direct::Args { near_paths, push }, shared.rays, handles, shared, lamps);
            dispatch(graph, args, groups, count).rays(count.into());
            // At the last segment the light of a virtual light would exceed the maximum number of bounces.
            if turn + 1 < settings.bounces {
                let (leaves, bounces) = (tree.leaves, settings.bounces);
                let push = near_pick::Push { count, turn, number, leaves, bounces, least, seed };
                let args = crate::rays::traced!(
                    near_pick::Args { vpls: vpls.buffer, vpl_nodes: tree.nodes, near_paths, push },
                    shared.rays
                );
                dispatch(graph, args, groups, count).rays(count.into());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        builtin,
        gpu::testing::with_gpu,
        resident::Resident,
        scene::{Material, Pose, View},
        techniques::igi::PictureSettings,
    };

    #[test]
    fn pictures_of_too_many_passes_are_refused_before_they_are_declared() {
        with_gpu(|gpu| {
            let mut scene = builtin::load("cornell-area").unwrap();
            scene.materials[0] = Material { metallic: 1.0, roughness: 0.0, ..scene.materials[0].clone() };
            let mut resident = Resident::new(gpu, &scene).unwrap();
            let mut igi = Igi::new(gpu, &scene, &resident, &Settings::default()).unwrap();
            let pose = Pose::rest(&scene);
            let mut declare = |settings: &Settings, [width, height]: [u32; 2]| {
                let view = View::of_camera(&scene, &pose, 0, [width, height]).unwrap();
                let mut graph = Graph::new("passes");
                let handles = resident.frame_in(&mut graph, &scene, &pose);
                let all = PictureSettings { igi: settings.clone(), ..Default::default() };
                let before = graph.pass_count() as u64;
                let result = igi.picture(&mut graph, &scene, &pose, &handles, &view, &all).map(|_| ());
                (result, graph.pass_count() as u64 - before, igi.many_passes(Extent::new(width, height), settings))
            };
            // The estimate is near what is declared.
            let base = Settings { vpls: 60, compensation: 8, bounces: 3, ..Settings::default() };
            for settings in [
                base.clone(),
                Settings { downsample: 4, ..base.clone() },
                Settings { downsample: 4, refine: 0.1, ..base.clone() },
                Settings { compensation: 0, specular_depth: 8, cache: 0.05, ..base.clone() },
            ] {
                let (result, declared, counted) = declare(&settings, [900, 700]);
                result.unwrap();
                assert!(counted <= declared && declared < counted + 120, "{declared} passes, counted {counted}");
            }
            let many = Settings { compensation: 64, bounces: 8, ..base.clone() };
            let (result, declared, _) = declare(&many, [9000, 8000]);
            let error = result.unwrap_err();
            assert!(error.exit_code() == 2 && declared < 60, "{declared} passes");
            for part in ["igi.compensation: ", "9000×8000 pixels", "allowed: 50000"] {
                assert!(error.to_string().contains(part), "{part} is not in {error}");
            }
        });
    }
}
