//! The charts of one mesh: the choice between uv2, planar groups, the unwrap library and the fallbacks.

use glam::{DVec2, Vec2};

use super::{
    chart::{Chart, overlaps, signed_area},
    groups,
    surface::{NONE, Surface},
    uv2,
};

/// Gives the most triangles that the unwrap library takes in a time in seconds on one core.
///
/// The rule fits measured times: 5,000 triangles take 0.3 s and 50,000 triangles take 7 s on one idle core, and up to
/// 14 s on a busy machine.
/// The rule is fixed, so that the speed of the machine never changes the result.
pub(super) fn triangle_budget(seconds: f64) -> usize {
    (10_000.0 * seconds.powf(0.6)) as usize
}

/// The largest ratio in area that the unwrap library may stretch or shrink a triangle.
const MAX_AREA_DISTORTION: f32 = 2.0;

/// The charts of one mesh.
pub(super) struct Layout {
    /// The charts in metres.
    pub(super) charts: Vec<Chart>,
    /// The triangles without a chart of their own.
    pub(super) collapsed: Vec<Collapsed>,
}

/// A degenerate triangle.
pub(super) struct Collapsed {
    /// The triangle.
    pub(super) triangle: u32,
    /// A triangle and a corner that touch it, or nothing if the triangle stands alone.
    pub(super) onto: Option<(u32, usize)>,
}

/// What a mesh brings besides its surface.
pub(super) struct Source<'a> {
    /// The triangles with the vertices of the mesh.
    pub(super) triangles: &'a [[u32; 3]],
    /// The number of vertices.
    pub(super) vertices: usize,
    /// The second texture coordinates if the caller allows them.
    pub(super) uv2: Option<&'a [Vec2]>,
    /// The most triangles that go to the unwrap library.
    pub(super) budget: usize,
    /// The name of the mesh in a note.
    pub(super) name: String,
}

/// Makes the charts of a mesh and adds a note about every fallback.
pub(super) fn layout(surface: &Surface, source: &Source<'_>, notes: &mut Vec<String>) -> Layout {
    let charts = match source.uv2.map(|uv2| uv2::charts(surface, source.triangles, uv2, source.vertices)) {
        Some(Ok(charts)) => charts,
        Some(Err(reason)) => {
            notes.push(format!("{} does not use its uv2, because {reason}.", source.name));
            own_charts(surface, source, notes)
        }
        None => own_charts(surface, source, notes),
    };
    let collapsed = collapse(surface, &charts);
    Layout { charts, collapsed }
}

/// Makes charts without uv2: framed planar groups first, the unwrap library for the curved rest.
fn own_charts(surface: &Surface, source: &Source<'_>, notes: &mut Vec<String>) -> Vec<Chart> {
    let all = vec![true; surface.triangles.len()];
    let planar = groups::planar(surface, &all);
    let mut group_of = vec![NONE; surface.triangles.len()];
    for (group, triangles) in planar.iter().enumerate() {
        for &triangle in triangles {
            group_of[triangle as usize] = group as u32;
        }
    }
    let (mut flat, mut curved) = (Vec::new(), Vec::new());
    for (group, triangles) in planar.iter().enumerate() {
        if groups::is_framed(surface, triangles, &group_of, group as u32) {
            flat.extend_from_slice(triangles);
        } else {
            curved.extend_from_slice(triangles);
        }
    }
    curved.sort_unstable();
    let mut charts = groups::project(surface, &flat, false);
    if curved.is_empty() {
        return charts;
    }
    if curved.len() > source.budget {
        notes.push(format!(
            "{} has {} curved triangles, more than the {} that the time budget allows; its charts are projections of \
             groups within 35 degrees.",
            source.name,
            curved.len(),
            source.budget
        ));
        charts.extend(groups::project(surface, &curved, true));
        return charts;
    }
    match unwrap(surface, &curved) {
        Ok(unwrapped) => {
            let mut failed = Vec::new();
            for chart in unwrapped {
                let flipped = chart.corners.iter().any(|c| signed_area(c) <= 0.0);
                if flipped || overlaps(&chart.corners) {
                    failed.extend_from_slice(&chart.triangles);
                } else {
                    charts.push(chart.turn_upright());
                }
            }
            if !failed.is_empty() {
                notes.push(format!(
                    "{} has {} triangles whose unwrapped charts overlap; their charts are projections instead.",
                    source.name,
                    failed.len()
                ));
                charts.extend(groups::project(surface, &failed, true));
            }
        }
        Err(reason) => {
            notes.push(format!("{} could not be unwrapped ({reason}); its charts are projections.", source.name));
            charts.extend(groups::project(surface, &curved, true));
        }
    }
    charts
}

/// Unwraps the given triangles with the library and gives its charts in metres.
fn unwrap(surface: &Surface, triangles: &[u32]) -> Result<Vec<Chart>, String> {
    let mut local = vec![NONE; surface.points.len()];
    let (mut positions, mut indices) = (Vec::new(), Vec::new());
    for &triangle in triangles {
        for vertex in surface.triangles[triangle as usize] {
            if local[vertex as usize] == NONE {
                local[vertex as usize] = positions.len() as u32;
                positions.push(surface.points[vertex as usize].as_vec3().to_array());
            }
            indices.push(local[vertex as usize]);
        }
    }
    let area: f64 = triangles.iter().map(|&t| surface.areas[t as usize]).sum();
    // The library only scales the charts with this density. About a million texels keep its coordinates exact.
    let options = uvunwrap::Options {
        max_area_distortion: MAX_AREA_DISTORTION,
        density: uvunwrap::Density::Fixed { texels_per_unit: (1_048_576.0 / area).sqrt() as f32, page_size: None },
        padding: 1,
        allow_rotation: false,
        packing: uvunwrap::Packing::Fast,
        ..uvunwrap::Options::default()
    };
    let mesh = uvunwrap::MeshInput::new(&positions, &indices);
    let atlas = uvunwrap::generate(&[mesh], &options).map_err(|error| error.to_string())?;
    let output = &atlas.meshes[0];
    let page = DVec2::new(f64::from(atlas.width), f64::from(atlas.height));
    let mut parts: Vec<(Vec<u32>, Vec<[DVec2; 3]>)> = vec![Default::default(); atlas.chart_count as usize];
    let mut left = Vec::new();
    for (&triangle, corners) in triangles.iter().zip(output.indices.as_chunks::<3>().0) {
        let vertices = corners.map(|index| &output.vertices[index as usize]);
        let flat = vertices.map(|v| Vec2::from_array(v.uv).as_dvec2() * page);
        match vertices[0].chart {
            Some(chart) if signed_area(&flat) != 0.0 => {
                parts[chart as usize].0.push(triangle);
                parts[chart as usize].1.push(flat);
            }
            _ => left.push(triangle),
        }
    }
    let mut charts = Vec::new();
    for (members, corners) in parts {
        if !members.is_empty() {
            let mut chart = Chart::new(members, corners);
            chart.keep_area(surface);
            charts.push(chart);
        }
    }
    // The library drops a triangle that it finds too thin. Such a triangle becomes a chart of its own.
    charts.extend(left.into_iter().map(|triangle| Chart::project(surface, vec![triangle])));
    Ok(charts)
}

/// Finds a corner of a chart for every triangle without a chart.
fn collapse(surface: &Surface, charts: &[Chart]) -> Vec<Collapsed> {
    let mut charted = vec![false; surface.triangles.len()];
    let mut owner: Vec<Option<(u32, usize)>> = vec![None; surface.points.len()];
    for &triangle in charts.iter().flat_map(|chart| &chart.triangles) {
        charted[triangle as usize] = true;
        for (corner, &vertex) in surface.triangles[triangle as usize].iter().enumerate() {
            let here = (triangle, corner);
            let owner = &mut owner[vertex as usize];
            if owner.is_none_or(|old| here < old) {
                *owner = Some(here);
            }
        }
    }
    (0..surface.triangles.len() as u32)
        .filter(|&triangle| !charted[triangle as usize])
        .map(|triangle| {
            let onto = surface.triangles[triangle as usize].iter().find_map(|&v| owner[v as usize]);
            Collapsed { triangle, onto }
        })
        .collect()
}
