//! Charts from the second texture coordinates of a mesh.

use glam::{DVec2, Vec2};

use super::{
    chart::{Chart, overlap, signed_area},
    surface::{NONE, Surface},
};

/// A triangle is flat in uv2 if its scale in area is below this fraction of the mean scale of its chart.
const MIN_RELATIVE_AREA: f64 = 1.0e-4;

/// Makes one chart from every connected part of uv2, or tells why uv2 is not usable.
///
/// A chart keeps its uv2 shape. Its two axes are scaled to metres.
pub(super) fn charts(
    surface: &Surface,
    triangles: &[[u32; 3]],
    uv2: &[Vec2],
    vertices: usize,
) -> Result<Vec<Chart>, String> {
    if uv2.len() != vertices {
        return Err(format!("it has {} entries for {vertices} vertices", uv2.len()));
    }
    let flat: Vec<[DVec2; 3]> = triangles.iter().map(|t| t.map(|v| uv2[v as usize].as_dvec2())).collect();
    if let Some(bad) = flat.iter().position(|c| c.iter().any(|p| !p.is_finite())) {
        return Err(format!("triangle {bad} has a coordinate that is not finite"));
    }
    let used: Vec<u32> = (0..triangles.len() as u32).filter(|&t| !surface.is_degenerate(t)).collect();
    if let Some(bad) = used.iter().find(|&&t| signed_area(&flat[t as usize]) == 0.0) {
        return Err(format!("triangle {bad} has no area in uv2"));
    }
    let corners: Vec<[DVec2; 3]> = used.iter().map(|&t| flat[t as usize]).collect();
    let (covered, double) = overlap(&corners);
    if double > 2 && double * 1000 > covered {
        let percent = double as f64 * 100.0 / covered as f64;
        return Err(format!("{percent:.1} % of its area is covered more than once (0.1 % is allowed)"));
    }
    let mut charts = Vec::new();
    for island in islands(surface, &flat, &used) {
        let mut chart = Chart::new(island.clone(), island.iter().map(|&t| flat[t as usize]).collect());
        let stretch = stretch(surface, &chart);
        chart.scale(stretch);
        chart.keep_area(surface);
        for (corner, &triangle) in chart.corners.iter().zip(&chart.triangles) {
            if signed_area(corner).abs() < surface.areas[triangle as usize] * MIN_RELATIVE_AREA {
                return Err(format!("triangle {triangle} has almost no area in uv2"));
            }
        }
        charts.push(chart);
    }
    Ok(charts)
}

/// Gives the parts of uv2 that hang together across edges with equal coordinates.
fn islands(surface: &Surface, flat: &[[DVec2; 3]], used: &[u32]) -> Vec<Vec<u32>> {
    let joined = |a: u32, edge: usize, b: u32| {
        let (ta, tb) = (surface.triangles[a as usize], surface.triangles[b as usize]);
        let same =
            |corner: usize| (0..3).any(|k| tb[k] == ta[corner] && flat[b as usize][k] == flat[a as usize][corner]);
        same(edge)
            && same((edge + 1) % 3)
            && (signed_area(&flat[a as usize]) > 0.0) == (signed_area(&flat[b as usize]) > 0.0)
    };
    let mut seen = vec![false; flat.len()];
    let mut islands = Vec::new();
    for &seed in used {
        if seen[seed as usize] {
            continue;
        }
        seen[seed as usize] = true;
        let mut island = vec![seed];
        let mut next = 0;
        while next < island.len() {
            let triangle = island[next];
            for (edge, &neighbour) in surface.neighbours[triangle as usize].iter().enumerate() {
                if neighbour != NONE && !seen[neighbour as usize] && joined(triangle, edge, neighbour) {
                    seen[neighbour as usize] = true;
                    island.push(neighbour);
                }
            }
            next += 1;
        }
        island.sort_unstable();
        islands.push(island);
    }
    islands
}

/// Gives the mean length in metres of one unit of u and of one unit of v.
fn stretch(surface: &Surface, chart: &Chart) -> DVec2 {
    let mut sum = DVec2::ZERO;
    for (flat, &triangle) in chart.corners.iter().zip(&chart.triangles) {
        let [a, b, c] = surface.corners(triangle);
        let (p, q) = (flat[1] - flat[0], flat[2] - flat[0]);
        let area = p.perp_dot(q);
        let du = ((b - a) * q.y - (c - a) * p.y) / area;
        let dv = ((c - a) * p.x - (b - a) * q.x) / area;
        sum += DVec2::new(du.length_squared(), dv.length_squared()) * surface.areas[triangle as usize];
    }
    let length = DVec2::new(sum.x.sqrt(), sum.y.sqrt());
    if length.is_finite() && length.min_element() > 0.0 { length } else { DVec2::ONE }
}
