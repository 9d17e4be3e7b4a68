//! Selective tone mapping, second and third step: the local component where the map says so (thesis 4.4.2.2).
//!
//! | [`Mark`] | how the others are spared |
//! |---|---|
//! | `branch` | a full-screen fragment shader reads the map and discards |
//! | `tiles` | tiles of 8 × 8 pixels without an important one are left out of an indirect dispatch |
//! | `early-z` | the map is drawn as depth, 0 where important and 1 elsewhere; the depth test, forced to come before the fragment shader, lets only important pixels start one |
//! | `compact` | the important pixels are listed, and an indirect dispatch has an invocation for each |
//!
//! All give the same picture to the bit: they call the same function of the same texels.

use super::{
    Local, Mark, Settings, bilateral, local,
    search::{Search, Tables},
};
use crate::{
    Result,
    graph::{Buffer, Compare, Depth, Draw, Extent, Format, Graph, Image, Load, Raster, Targets, Uniform},
    shaders::{
        consts,
        tonemap::{
            list_groups, list_pixels, list_tiles, mark_depth, marked_branch, marked_compact, marked_early_z,
            marked_tiles,
        },
        types::TonemapBilateral,
    },
};

/// Pixels of the list of `compact`: a larger image is served in bands of rows, so that the list stays at 64 MiB, under what
/// every device can bind.
const LIST_PIXELS: u32 = 1 << 24;

/// Depth of the important pixels, of the others, and of the draw that the test lets through only at the former.
const DEPTH_IMPORTANT: f32 = 0.0;
const DEPTH_OTHER: f32 = 1.0;
const DEPTH_DRAWN: f32 = 0.5;

/// Local adaptation where `importance` is not 0; elsewhere the luminance itself, from which the operator's curve makes what its global
/// mode shows. `picture`: extent of the whole picture, of which `luminance` may be a part.
///
/// By definition, Gaussian averages are computed for the important pixels alone, and so is the bilateral filter both ways. Averages along
/// rows ([`Local::Fast`]) and of halved pictures ([`Local::Pyramid`]) share work between neighbours: they are computed for all pixels; what
/// follows from them, in blocks that have an important one.
///
/// # Errors
/// `Usage` if the settings cannot serve a picture of this extent.
pub fn adapt(
    graph: &mut Graph,
    luminance: Image,
    importance: Image,
    statistics: Buffer,
    picture: Extent,
    settings: &Settings,
) -> Result<Image> {
    let extent = graph.extent(luminance);
    let LocalPasses { local, tables: Tables { search, weights }, adaptation, logarithm, blocks, bilateral } =
        prepare(graph, luminance, importance, statistics, picture, settings)?;
    let adapted = graph.image("tonemap.adapted", Format::R32F, extent);
    graph.copy(luminance, adapted);
    let target = Targets::new().color(adapted, Load::Keep);
    match settings.mark {
        Mark::Branch => {
            let args = marked_branch::Args {
                luminance,
                search,
                weights,
                statistics,
                adaptation,
                logarithm,
                blocks,
                bilateral,
                importance,
                spec: marked_branch::Spec { local },
            };
            graph.raster(target, Raster::new(), args, Draw::fullscreen()).counted();
        }
        Mark::EarlyZ => {
            let depth = graph.image("tonemap.marked", Format::D32F, extent);
            mark_depth(graph, importance, depth);
            let args = marked_early_z::Args {
                luminance,
                search,
                weights,
                statistics,
                adaptation,
                logarithm,
                blocks,
                bilateral,
                spec: marked_early_z::Spec { local },
            };
            let (target, state) = early_z(target, depth);
            graph.raster(target, state, args, Draw::fullscreen_at(DEPTH_DRAWN)).counted();
        }
        Mark::Tiles => {
            let size = extent.div_ceil(8);
            let count = graph.buffer("tonemap.tile_count", 4);
            let tiles = graph.buffer("tonemap.tiles", 4 * size.pixels());
            graph.fill(count, 0);
            graph.compute(list_tiles::Args { importance, count, tiles }, extent);
            let groups = groups(graph, count, 1);
            let args = marked_tiles::Args {
                luminance,
                search,
                weights,
                statistics,
                adaptation,
                logarithm,
                blocks,
                bilateral,
                importance,
                count,
                tiles,
                adapted,
                spec: marked_tiles::Spec { local },
            };
            graph.compute_indirect(args, groups, 0).counted();
        }
        Mark::Compact => {
            let band = (LIST_PIXELS / extent.width.max(1)).clamp(1, extent.height.max(1));
            for first_row in (0..extent.height).step_by(band as usize) {
                let rows = band.min(extent.height - first_row);
                let count = graph.buffer("tonemap.pixel_count", 4);
                let pixels = graph.buffer("tonemap.pixels", 4 * u64::from(extent.width) * u64::from(rows));
                graph.fill(count, 0);
                let push = list_pixels::Push { first_row, rows };
                graph.compute(list_pixels::Args { importance, count, pixels, push }, [extent.width, rows]);
                let groups = groups(graph, count, 64);
                let args = marked_compact::Args {
                    luminance,
                    search,
                    weights,
                    statistics,
                    adaptation,
                    logarithm,
                    blocks,
                    bilateral,
                    count,
                    pixels,
                    adapted,
                    spec: marked_compact::Spec { local },
                };
                graph.compute_indirect(args, groups, 0).counted();
            }
        }
    }
    Ok(adapted)
}

/// What the local component of a pixel reads; what it does not read is bound to something of its kind.
struct LocalPasses {
    /// One of the constants `LOCAL_…`.
    local: u32,
    tables: Tables,
    adaptation: Image,
    logarithm: Image,
    blocks: Image,
    bilateral: Uniform<TonemapBilateral>,
}

/// Declares what has to be computed before.
fn prepare(
    graph: &mut Graph,
    luminance: Image,
    importance: Image,
    statistics: Buffer,
    picture: Extent,
    settings: &Settings,
) -> Result<LocalPasses> {
    let (mut local, mut adaptation, mut logarithm, mut blocks) =
        (consts::LOCAL_LOOKUP, luminance, luminance, luminance);
    let mut bilateral = TonemapBilateral::default();
    let search = Search::new(settings);
    let tables = match (&search, settings.local) {
        (Some(search), Local::Literal) => {
            local = consts::LOCAL_LITERAL;
            search.tables(graph)
        }
        (Some(search), Local::Growing) => {
            local = consts::LOCAL_GROWING;
            search.tables(graph)
        }
        (Some(_), Local::Fast | Local::Pyramid) => {
            adaptation = local::adaptation(graph, luminance, Some(importance), statistics, picture, settings)?;
            Tables::none(graph)
        }
        (None, _) => {
            local = consts::LOCAL_BILATERAL;
            let source = bilateral::source(graph, luminance, statistics, picture, settings)?;
            (logarithm, blocks, bilateral) = (source.logarithm, source.blocks, source.bilateral);
            Tables::none(graph)
        }
    };
    let bilateral = graph.uniform(&bilateral);
    Ok(LocalPasses { local, tables, adaptation, logarithm, blocks, bilateral })
}

/// Draws the map as depth.
pub fn mark_depth(graph: &mut Graph, importance: Image, depth: Image) {
    let target = Targets::new().depth(depth, Depth::Clear(DEPTH_OTHER));
    let state = Raster::new().depth_compare(Compare::Always);
    graph.raster(target, state, mark_depth::Args { importance }, Draw::fullscreen_at(DEPTH_IMPORTANT));
}

/// Targets and state with which [`Draw::fullscreen_at`] 0.5 reaches only what [`mark_depth()`] marked. Nothing writes depth.
pub fn early_z(targets: Targets, depth: Image) -> (Targets, Raster) {
    (targets.depth(depth, Depth::ReadOnly), Raster::new().depth_write(false).depth_compare(Compare::Greater))
}

/// Group counts for an indirect dispatch over `count` items.
fn groups(graph: &mut Graph, count: Buffer, items: u32) -> Buffer {
    let groups = graph.buffer("tonemap.groups", 12);
    graph.compute(list_groups::Args { count, groups, push: list_groups::Push { items } }, 1);
    groups
}
