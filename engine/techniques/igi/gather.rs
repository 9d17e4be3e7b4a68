//! Gathering: irradiance of the visible surfaces from all virtual lights, or from a few that each receiver picks from the light tree.

use super::{Igi, LightTree, Settings, Shared, Vpls, rays};
use crate::{
    graph::{Buffer, Extent, Format, Graph, Image},
    passes::gbuffer::GBuffer,
    shaders::igi::{gather, gather_picks, refine, refine_groups},
};

/// Invocations per workgroup of the pass that gathers for listed pixels.
const GROUP: u64 = 64;
/// Workgroups per dispatch that every device allows.
const MOST_GROUPS: u64 = 65_535;

/// Splits `pixels` pixels into ranges of about `most` pixels. Returns the pixels per range and the number of ranges.
fn ranges(pixels: u64, most: u64) -> (u32, u32) {
    let groups = (most / GROUP).clamp(1, MOST_GROUPS);
    ((groups * GROUP) as u32, pixels.div_ceil(groups * GROUP).max(1) as u32)
}

/// Indirect dispatch sizes (three u32 per range) for `ranges` ranges of `pixels` pixels of the list `unmatched`, whose length only the
/// device knows.
pub(super) fn listed_groups(graph: &mut Graph, unmatched: Buffer, pixels: u32, ranges: u32) -> Buffer {
    let groups = graph.buffer("igi.refine-groups", 12 * u64::from(ranges));
    let push = refine_groups::Push { ranges, pixels };
    graph.compute(refine_groups::Args { unmatched, groups, push }, ranges);
    groups
}

impl Igi {
    /// Irradiance of every [`Settings::downsample`]-th pixel, W/m² (equation 1 without ρ); alpha: number of shadow rays.
    pub(super) fn gather(
        &self,
        graph: &mut Graph,
        g: &GBuffer,
        shared: &Shared,
        vpls: Option<Vpls>,
        settings: &Settings,
    ) -> Image {
        let extent = graph.extent(g.depth).div_ceil(settings.downsample);
        let irradiance = graph.image("igi.irradiance", Format::RGBA32F, extent);
        graph.clear(irradiance, [0.0; 4]);
        let Some(vpls) = vpls else { return irradiance };
        match vpls.tree {
            Some(tree) if settings.picks_from(vpls.count) => {
                self.gather_picks(graph, g, shared, (vpls, tree), settings, irradiance)
            }
            _ => self.gather_all(graph, g, shared, vpls, settings, irradiance),
        }
        irradiance
    }

    fn gather_all(
        &self,
        graph: &mut Graph,
        g: &GBuffer,
        shared: &Shared,
        vpls: Vpls,
        settings: &Settings,
        irradiance: Image,
    ) {
        let extent = graph.extent(irradiance);
        let own = vpls.count.div_ceil(settings.interleave * settings.interleave);
        for (first, count) in self.batches(extent, own) {
            let push = gather::Push {
                first,
                count,
                total: vpls.count,
                tile: settings.interleave,
                factor: settings.downsample,
                scattered: settings.scattered.into(),
                least: shared.least,
                stride: settings.stride(),
                seed: shared.seed,
            };
            let spec = gather::Spec { imperfect: settings.imperfect.into() };
            let args = crate::rays::traced!(
                gather::Args {
                    view: g.view,
                    normal: g.normal,
                    depth: g.depth,
                    vpls: vpls.buffer,
                    irradiance,
                    push,
                    spec
                },
                shared.hidden_by
            );
            graph.compute(args, extent).rays(rays(extent, count));
        }
    }

    /// How [`Self::refine`] splits its work: ranges (first, count) of lights, pixels per range of pixels, and number of these ranges.
    /// `own`: lights per pixel.
    pub(super) fn refined(&self, extent: Extent, own: u32) -> (Vec<(u32, u32)>, u32, u32) {
        // A dispatch gathers a few hundred lights for thousands of pixels. Most ranges of pixels are empty.
        let lights = self.batches(Extent::new(1 << 14, 1), own);
        let most = lights.first().map_or(1, |&(_, count)| count);
        let (pixels, ranges) = ranges(extent.pixels(), self.rays_at_once / u64::from(most.max(1)));
        (lights, pixels, ranges)
    }

    /// Gathers for the pixels in the list `unmatched` of [`filters::upsample`](super::filters::upsample), each from one subset. If the
    /// bound is compensated, [`Self::compensate_listed`] runs afterwards and dims the specks.
    pub(super) fn refine(
        &self,
        graph: &mut Graph,
        g: &GBuffer,
        shared: &Shared,
        vpls: Vpls,
        settings: &Settings,
        (irradiance, unmatched): (Image, Buffer),
    ) {
        let own = vpls.count.div_ceil(settings.interleave * settings.interleave);
        let (lights, pixels, ranges) = self.refined(graph.extent(irradiance), own);
        let groups = listed_groups(graph, unmatched, pixels, ranges);
        for (range, (first, count)) in (0..ranges).flat_map(|range| lights.iter().map(move |&lights| (range, lights))) {
            let push = refine::Push {
                first,
                count,
                total: vpls.count,
                tile: settings.interleave,
                least: shared.least,
                stride: settings.stride(),
                seed: shared.seed,
                own,
                begin: range * pixels,
                limit: if settings.compensates() { 0.0 } else { settings.despeckle },
            };
            let args = crate::rays::traced!(
                refine::Args {
                    view: g.view,
                    normal: g.normal,
                    depth: g.depth,
                    vpls: vpls.buffer,
                    irradiance,
                    unmatched,
                    push,
                    spec: refine::Spec { imperfect: settings.imperfect.into() },
                },
                shared.hidden_by
            );
            graph.compute_indirect(args, groups, 12 * u64::from(range)).rays(u64::from(pixels) * u64::from(count));
        }
    }

    fn gather_picks(
        &self,
        graph: &mut Graph,
        g: &GBuffer,
        shared: &Shared,
        (vpls, tree): (Vpls, LightTree),
        settings: &Settings,
        irradiance: Image,
    ) {
        let extent: Extent = graph.extent(irradiance);
        let picks = settings.texel_picks();
        for (first, count) in self.batches(extent, picks) {
            let push = gather_picks::Push {
                first,
                count,
                picks,
                proposals: settings.proposals,
                leaves: tree.leaves,
                tile: settings.interleave,
                factor: settings.downsample,
                scattered: settings.scattered.into(),
                least: shared.least,
                stride: settings.stride(),
                seed: shared.seed,
            };
            let args = crate::rays::traced!(
                gather_picks::Args {
                    view: g.view,
                    normal: g.normal,
                    depth: g.depth,
                    vpls: vpls.buffer,
                    irradiance,
                    vpl_nodes: tree.nodes,
                    push,
                    spec: gather_picks::Spec { imperfect: settings.imperfect.into() },
                },
                shared.hidden_by
            );
            graph.compute(args, extent).rays(rays(extent, count));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_hold_all_pixels_in_dispatches_that_every_device_allows() {
        for (width, height) in [(1u64, 1u64), (64, 1), (65, 1), (800, 600), (3840, 2160), (16384, 16384)] {
            for rays in [1u64, 2, 180, 10_000, u64::MAX] {
                let (pixels, ranges) = ranges(width * height, super::super::MOST_RAYS / rays);
                let (of_range, ranges) = (u64::from(pixels), u64::from(ranges));
                assert!(of_range * ranges >= width * height && of_range * (ranges - 1) < width * height);
                assert!(of_range % GROUP == 0 && of_range / GROUP <= MOST_GROUPS);
                assert!(rays == u64::MAX || of_range * rays <= super::super::MOST_RAYS.max(GROUP * rays));
            }
        }
    }
}
