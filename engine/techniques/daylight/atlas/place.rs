//! The scale of the charts in texels and their place in the atlas.

use glam::{DVec2, Vec2};

use super::{
    Atlas, Settings,
    chart::Chart,
    layout::{Collapsed, Layout},
    pack::{Item, Packing, pack},
};

/// An extent this close to a whole number of texels is snapped to it.
const SNAP: f64 = 1.0e-3;

/// The largest extent in texels that is packed in order to name the needed size.
const MAX_EXTENT: f64 = 16_777_216.0;

/// The rounds of the search for the density that fits.
const SEARCH_ROUNDS: u32 = 12;

/// An instance and its layout.
pub(super) struct Placed<'a> {
    /// The index of the layout.
    pub(super) layout: usize,
    /// The mean scale of the instance in metres per object unit.
    pub(super) scale: f64,
    /// The number of triangles.
    pub(super) triangles: usize,
    /// Whether each triangle needs texels; `None`: all do.
    pub(super) wanted: Option<&'a [bool]>,
}

impl Placed<'_> {
    /// Tells whether a triangle needs texels.
    fn wants(&self, triangle: u32) -> bool {
        self.wanted.is_none_or(|wanted| wanted[triangle as usize])
    }

    /// Gives the charts with a triangle that needs texels.
    fn charts<'l>(&self, layouts: &'l [Layout]) -> impl Iterator<Item = &'l Chart> {
        layouts[self.layout].charts.iter().filter(|chart| chart.triangles.iter().any(|triangle| self.wants(*triangle)))
    }

    /// Tells whether a degenerate triangle stands alone and needs a chart of one texel.
    fn needs_point(&self, layouts: &[Layout]) -> bool {
        let alone = |collapsed: &Collapsed| collapsed.onto.is_none() && self.wants(collapsed.triangle);
        layouts[self.layout].collapsed.iter().any(alone)
    }
}

/// The place of triangles of a chart that was left out.
const NOWHERE: [Vec2; 3] = [Vec2::INFINITY; 3];

/// The extent of a chart along one axis in texels.
#[derive(Clone, Copy)]
struct Extent {
    /// The whole texels.
    texels: u32,
    /// The correction of the scale that snaps to whole texels.
    factor: f64,
    /// The distance from the origin of the chart in texels.
    offset: f64,
}

impl Extent {
    /// Rounds an extent up to whole texels and centres it.
    fn new(extent: f64) -> Self {
        let nearest = extent.round();
        if nearest >= 1.0 && (extent - nearest).abs() <= SNAP {
            return Self { texels: nearest as u32, factor: nearest / extent, offset: 0.0 };
        }
        let texels = extent.ceil().max(1.0);
        Self { texels: texels as u32, factor: 1.0, offset: (texels - extent) * 0.5 }
    }
}

/// Scales and packs all charts and gives the atlas.
pub(super) fn place(
    layouts: &[Layout],
    placed: &[Placed<'_>],
    settings: &Settings,
    notes: Vec<String>,
) -> Result<Atlas, String> {
    let density = f64::from(settings.texels_per_metre);
    let packing =
        pack_at(layouts, placed, settings, density).filter(|p| atlas_side(p.side(), settings) <= limit(settings));
    let Some(packing) = packing else {
        return Err(too_large(layouts, placed, settings));
    };
    let mut atlas = Atlas {
        width: atlas_side(packing.width, settings) as u32,
        height: atlas_side(packing.height, settings) as u32,
        corners: Vec::with_capacity(placed.iter().map(|p| p.triangles).sum()),
        triangle_charts: Vec::new(),
        charts: packing.places.len() as u32,
        notes,
    };
    let mut places = packing.places.iter();
    let mut chart_number = 0;
    for instance in placed {
        let layout = &layouts[instance.layout];
        let base = atlas.corners.len();
        atlas.corners.resize(base + instance.triangles, NOWHERE);
        atlas.triangle_charts.resize(base + instance.triangles, u32::MAX);
        let scale = density * instance.scale;
        for chart in instance.charts(layouts) {
            let place = places.next().expect("every chart has a place");
            let (x, y) = (Extent::new(chart.size.x * scale), Extent::new(chart.size.y * scale));
            let factor = DVec2::new(x.factor, y.factor) * scale;
            let offset = DVec2::new(x.offset, y.offset);
            let origin = origin(place.x, place.y, settings);
            for (corners, &triangle) in chart.corners.iter().zip(&chart.triangles) {
                atlas.corners[base + triangle as usize] = corners.map(|corner| {
                    let flat = corner * factor + offset;
                    let turned = DVec2::new(f64::from(y.texels) - flat.y, flat.x);
                    (origin + if place.turned { turned } else { flat }).as_vec2()
                });
                atlas.triangle_charts[base + triangle as usize] = chart_number;
            }
            chart_number += 1;
        }
        let lonely = instance.needs_point(layouts).then(|| {
            let place = places.next().expect("the lonely triangles have a place");
            chart_number += 1;
            (origin(place.x, place.y, settings) + 0.5).as_vec2()
        });
        for collapsed in &layout.collapsed {
            let target = base + collapsed.triangle as usize;
            let (point, chart) = match collapsed.onto {
                Some((triangle, corner)) => {
                    let corners = atlas.corners[base + triangle as usize];
                    if corners == NOWHERE {
                        continue;
                    }
                    // A point just inside the neighbour lies in a texel that the neighbour covers.
                    let centre = (corners[0] + corners[1] + corners[2]) / 3.0;
                    let inside = corners[corner].lerp(centre, 0.01);
                    (inside.floor() + 0.5, atlas.triangle_charts[base + triangle as usize])
                }
                None => match lonely {
                    Some(point) => (point, chart_number - 1),
                    None => continue,
                },
            };
            atlas.corners[target] = [point; 3];
            atlas.triangle_charts[target] = chart;
        }
    }
    Ok(atlas)
}

/// Gives the width of the free border at the left and at the top in texels.
fn border(settings: &Settings) -> u32 {
    settings.padding.next_multiple_of(settings.block)
}

/// Gives the origin of a chart in texels.
fn origin(x: u32, y: u32, settings: &Settings) -> DVec2 {
    let texel = |blocks: u32| f64::from(border(settings) + blocks * settings.block);
    DVec2::new(texel(x), texel(y))
}

/// Turns a side in blocks into a side of the atlas in texels.
fn atlas_side(blocks: u32, settings: &Settings) -> u64 {
    (u64::from(border(settings)) + u64::from(blocks) * u64::from(settings.block)).next_multiple_of(4)
}

/// Gives the largest allowed side in texels.
fn limit(settings: &Settings) -> u64 {
    u64::from(settings.max_size / 4 * 4)
}

/// Packs all charts at a density, or gives nothing if a chart is too large to count.
fn pack_at(layouts: &[Layout], placed: &[Placed<'_>], settings: &Settings, density: f64) -> Option<Packing> {
    let mut items = Vec::new();
    let blocks = |texels: u32| (texels + settings.padding).div_ceil(settings.block);
    for instance in placed {
        for chart in instance.charts(layouts) {
            let size = chart.size * (density * instance.scale);
            if size.is_nan() || size.max_element() > MAX_EXTENT {
                return None;
            }
            let (x, y) = (Extent::new(size.x), Extent::new(size.y));
            items.push(Item { width: blocks(x.texels), height: blocks(y.texels) });
        }
        if instance.needs_point(layouts) {
            items.push(Item { width: blocks(1), height: blocks(1) });
        }
    }
    let area: f64 = items.iter().map(|item| f64::from(item.width) * f64::from(item.height)).sum();
    if area > MAX_EXTENT * MAX_EXTENT {
        return None;
    }
    let limit = (limit(settings).saturating_sub(u64::from(border(settings))) / u64::from(settings.block)) as u32;
    Some(pack(&items, limit))
}

/// Says what size the charts need and what density fits.
fn too_large(layouts: &[Layout], placed: &[Placed<'_>], settings: &Settings) -> String {
    let wanted = f64::from(settings.texels_per_metre);
    let fits = |density: f64| {
        pack_at(layouts, placed, settings, density).is_some_and(|p| atlas_side(p.side(), settings) <= limit(settings))
    };
    let size = match pack_at(layouts, placed, settings, wanted) {
        Some(p) => format!("{0} x {1} texels", atlas_side(p.width, settings), atlas_side(p.height, settings)),
        None => format!("more than {MAX_EXTENT} texels along one side"),
    };
    let max_size = settings.max_size;
    let problem = format!(
        "The lightmap needs {size} at {} texels per metre, but max_size allows {max_size} x {max_size} texels.",
        settings.texels_per_metre
    );
    // At the low end every chart takes one texel.
    let largest = placed
        .iter()
        .flat_map(|p| p.charts(layouts).map(|chart| chart.size.max_element() * p.scale))
        .fold(0.0, f64::max);
    let (mut low, mut high) = (wanted.min(0.5 / largest), wanted);
    if !fits(low) {
        let charts: usize = placed.iter().map(|p| p.charts(layouts).count()).sum();
        return format!(
            "{problem} Its {charts} charts do not fit at any density, because each takes at least one texel and its \
             padding. Raise max_size, lower padding, or give meshes with fewer separate parts."
        );
    }
    for _ in 0..4 * SEARCH_ROUNDS {
        if high < low * 1.005 {
            break;
        }
        // The ratio of the sides is a good first guess; the geometric mean always ends the search.
        let middle = (low * high).sqrt();
        if fits(middle) { low = middle } else { high = middle }
    }
    // Three digits are easy to type. The rounded value must fit as well.
    let mut density = round_down(low);
    for _ in 0..SEARCH_ROUNDS {
        if fits(f64::from(density)) {
            break;
        }
        density = round_down(f64::from(density) * 0.99);
    }
    format!("{problem} Set texels_per_metre to {density} or raise max_size.")
}

/// Rounds a positive number down to three significant digits.
fn round_down(value: f64) -> f32 {
    let shown: f64 = format!("{value:.2e}").parse().unwrap_or(value);
    let lower = if shown > value { value * 0.99 } else { value };
    format!("{lower:.2e}").parse().unwrap_or(lower as f32)
}
