//! Groups of neighbouring triangles that one projection makes flat.

use std::collections::BTreeMap;

use glam::DVec3;

use super::{
    chart::{Chart, mean_normal, overlaps, signed_area},
    surface::{COS_1_DEGREE, NONE, Surface},
};

/// The cosine of 40 degrees. An edge with a larger angle between its normals is hard.
const COS_HARD_EDGE: f64 = 0.766_044_443_118_978;

/// The cosine of 35 degrees, the widest cone of the coarse groups.
const COS_COARSE: f64 = 0.819_152_044_288_991_8;

/// The cosine of 60 degrees, the widest angle at which a small group joins another one.
const COS_MERGE: f64 = 0.5;

/// The part of the total area below which a group is small.
const SMALL_GROUP: f64 = 0.01;

/// The smallest hard part of the perimeter that makes a planar group a chart of its own.
const HARD_PERIMETER: f64 = 0.7;

/// Grows groups from the largest triangle downwards.
///
/// A neighbour joins if its normal lies within the cone around the normal of the first triangle. The result depends on
/// the surface only. Only the triangles with `member[triangle]` take part.
pub(super) fn grow(surface: &Surface, member: &[bool], cos_cone: f64) -> Vec<Vec<u32>> {
    let mut seeds: Vec<u32> =
        (0..member.len() as u32).filter(|&t| member[t as usize] && !surface.is_degenerate(t)).collect();
    seeds.sort_by(|&a, &b| surface.areas[b as usize].total_cmp(&surface.areas[a as usize]).then(a.cmp(&b)));
    let mut free = vec![false; member.len()];
    for &seed in &seeds {
        free[seed as usize] = true;
    }
    let mut groups = Vec::new();
    for seed in seeds {
        if !free[seed as usize] {
            continue;
        }
        free[seed as usize] = false;
        let normal = surface.normals[seed as usize];
        let mut group = vec![seed];
        let mut next = 0;
        while next < group.len() {
            for neighbour in surface.neighbours[group[next] as usize] {
                if neighbour != NONE
                    && free[neighbour as usize]
                    && surface.normals[neighbour as usize].dot(normal) >= cos_cone
                {
                    free[neighbour as usize] = false;
                    group.push(neighbour);
                }
            }
            next += 1;
        }
        group.sort_unstable();
        groups.push(group);
    }
    groups
}

/// Tells whether most of the perimeter of a group is hard: a sharp or an open edge.
///
/// `group_of` gives the group of every triangle, and `group` is the number of this group. A single triangle with a
/// neighbour never counts, because a rough surface has many of them.
pub(super) fn is_framed(surface: &Surface, triangles: &[u32], group_of: &[u32], group: u32) -> bool {
    if triangles.len() == 1 && surface.neighbours[triangles[0] as usize] != [NONE; 3] {
        return false;
    }
    let (mut hard, mut total) = (0.0, 0.0);
    for &triangle in triangles {
        let corners = surface.corners(triangle);
        for (edge, &neighbour) in surface.neighbours[triangle as usize].iter().enumerate() {
            if neighbour != NONE && group_of[neighbour as usize] == group {
                continue;
            }
            let length = corners[edge].distance(corners[(edge + 1) % 3]);
            total += length;
            if neighbour == NONE
                || surface.normals[triangle as usize].dot(surface.normals[neighbour as usize]) < COS_HARD_EDGE
            {
                hard += length;
            }
        }
    }
    hard >= total * HARD_PERIMETER
}

/// Merges small groups into the neighbour with the longest common border.
///
/// A group is small if it has less than 1 % of the area of all groups. It only joins a neighbour if all its normals lie
/// within 60 degrees of the mean normal of that neighbour, so that a projection stays one-to-one nearby.
fn merge_small(surface: &Surface, groups: Vec<Vec<u32>>) -> Vec<Vec<u32>> {
    let mut groups = groups;
    let mut group_of = vec![NONE; surface.triangles.len()];
    for (group, triangles) in groups.iter().enumerate() {
        for &triangle in triangles {
            group_of[triangle as usize] = group as u32;
        }
    }
    let area_of = |triangles: &[u32]| triangles.iter().map(|&t| surface.areas[t as usize]).sum::<f64>();
    let areas: Vec<f64> = groups.iter().map(|triangles| area_of(triangles)).collect();
    let normals: Vec<DVec3> = groups.iter().map(|triangles| mean_normal(surface, triangles)).collect();
    let small = areas.iter().sum::<f64>() * SMALL_GROUP;
    let mut order: Vec<usize> = (0..groups.len()).filter(|&group| areas[group] < small).collect();
    order.sort_by(|&a, &b| areas[a].total_cmp(&areas[b]).then(a.cmp(&b)));
    for group in order {
        let mut borders: BTreeMap<u32, f64> = BTreeMap::new();
        for &triangle in &groups[group] {
            let corners = surface.corners(triangle);
            for (edge, &neighbour) in surface.neighbours[triangle as usize].iter().enumerate() {
                let other = if neighbour == NONE { NONE } else { group_of[neighbour as usize] };
                if other != NONE && other as usize != group {
                    *borders.entry(other).or_default() += corners[edge].distance(corners[(edge + 1) % 3]);
                }
            }
        }
        let fits = |other: u32| {
            let normal = normals[other as usize];
            groups[group].iter().all(|&t| surface.normals[t as usize].dot(normal) >= COS_MERGE)
        };
        let mut best: Option<(u32, f64)> = None;
        for (other, length) in borders {
            if best.is_none_or(|(_, longest)| length > longest) && fits(other) {
                best = Some((other, length));
            }
        }
        if let Some((other, _)) = best {
            let triangles = std::mem::take(&mut groups[group]);
            for &triangle in &triangles {
                group_of[triangle as usize] = other;
            }
            groups[other as usize].extend(triangles);
        }
    }
    groups.retain(|triangles| !triangles.is_empty());
    groups
}

/// Gives the planar groups of the triangles with `member[triangle]`.
pub(super) fn planar(surface: &Surface, member: &[bool]) -> Vec<Vec<u32>> {
    grow(surface, member, COS_1_DEGREE)
}

/// Makes charts without a solver: cones of 35 degrees with small cones merged, else planar groups, else single
/// triangles.
///
/// A group that overlaps itself after its projection goes on to the next method.
pub(super) fn project(surface: &Surface, triangles: &[u32], coarse: bool) -> Vec<Chart> {
    let mut charts = Vec::new();
    let mut open = vec![false; surface.triangles.len()];
    for &triangle in triangles {
        open[triangle as usize] = true;
    }
    for cone in [coarse.then_some(COS_COARSE), Some(COS_1_DEGREE)].into_iter().flatten() {
        let mut groups = grow(surface, &open, cone);
        if cone == COS_COARSE {
            groups = merge_small(surface, groups);
        }
        for group in groups {
            let chart = Chart::project(surface, group);
            let is_flipped = chart.corners.iter().any(|corners| signed_area(corners) <= 0.0);
            if chart.triangles.len() > 1 && (is_flipped || overlaps(&chart.corners)) {
                continue;
            }
            for &triangle in &chart.triangles {
                open[triangle as usize] = false;
            }
            charts.push(chart);
        }
    }
    for triangle in 0..open.len() as u32 {
        if open[triangle as usize] && !surface.is_degenerate(triangle) {
            charts.push(Chart::project(surface, vec![triangle]));
        }
    }
    charts
}
