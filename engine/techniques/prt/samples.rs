//! Samples on surfaces without a mesh: thinning and areas (Leonhardt and Bohn, section 4.1).

use std::collections::HashMap;

use glam::{Vec2, Vec3};

use super::{components::components, grid::Nearby};
use crate::{
    scene::{Pose, Scene},
    shaders::{
        consts::{PRT_CLEAR, PRT_DENSITY, PRT_STEP},
        types::{PrtPoint, PrtSample},
    },
};

/// Width of slits without samples, as a share of the least distance of samples: light changes in them over distances that no sample can show.
const SLIT: f32 = 0.05;
/// Points on surfaces for each sample, from which its area follows.
const POINTS: usize = 50;
/// Hits of a triangle below which they are stray ones, as a share of those that its area would have.
const STRAY: f64 = 0.02;

pub(super) fn position(point: &PrtPoint) -> Vec3 {
    Vec3::from(point.position)
}

pub(super) fn side(point: &PrtPoint) -> Vec3 {
    Vec3::from(point.side)
}

/// Samples in a grid, to which more are added while they are thinned.
#[derive(Debug)]
pub(super) struct Thinning {
    radius: f32,
    /// Least distance of two samples in the narrowest gaps, as a share of the radius; 1: the same everywhere.
    gaps: f32,
    cells: HashMap<[i32; 3], Vec<u32>>,
    pub samples: Vec<PrtPoint>,
    /// The connected component that each sample is on.
    components: Vec<u32>,
}

impl Thinning {
    /// `radius`: least distance of two samples on a plane, metres. `gaps`: that in the narrowest gaps, as a share of it. If it is below 1, the areas of all
    /// candidates are free distances above their surfaces, metres.
    pub fn new(radius: f32, gaps: f32) -> Self {
        Self { radius, gaps, cells: HashMap::new(), samples: Vec::new(), components: Vec::new() }
    }

    /// Largest free distance that counts, metres; 0: none does.
    pub fn most_clear(&self) -> f32 {
        if self.gaps < 1.0 { PRT_CLEAR * self.radius } else { 0.0 }
    }

    /// Keeps a candidate if no sample is too close. The least distance shrinks with the angle between the normals, so that curved
    /// surfaces have more samples, and two sides of a sheet do not count for each other. Slits have no samples, so they are dark.
    pub fn offer(&mut self, candidate: &PrtPoint, component: u32) -> bool {
        if candidate.area < slit(self.radius, self.gaps) {
            return false;
        }
        let at = position(candidate);
        let cell = |v: Vec3| (v / self.radius).floor().as_ivec3();
        let share = |point: &PrtPoint| share_in_gap(point.area, self.radius, self.gaps);
        let own_share = share(candidate);
        // No sample from here on is close, whatever its normal; with more than the rounding error of unit normals.
        let far = 1.0001 * (self.radius * own_share).powi(2);
        let close = |other: &u32| {
            let number = *other as usize;
            let other = &self.samples[number];
            if position(other).distance_squared(at) > far {
                return false;
            }
            // A picture on a wall has samples of its own, and so has each book on a shelf.
            let strange = if self.components[number] == component { 1.0 } else { 0.6 };
            let least = strange * self.radius * (0.5 + 0.5 * side(other).dot(side(candidate)));
            // A step to a parallel surface counts as a way along the surface that is longer.
            let way = position(other) - at;
            let step = way.dot((side(other) + side(candidate)).normalize_or_zero());
            let away = way.length_squared() + PRT_STEP * step * step;
            away < least * least && away < (least * own_share.min(share(other))).powi(2)
        };
        let any = |cell: [i32; 3]| self.cells.get(&cell).is_some_and(|others| others.iter().any(close));
        // Most candidates are too close to a sample of their own cell.
        let own = cell(at).to_array();
        if any(own) {
            return false;
        }
        let [low, high] = [-self.radius, self.radius].map(|by| cell(at + by * own_share));
        for z in low.z..=high.z {
            for y in low.y..=high.y {
                for x in low.x..=high.x {
                    if [x, y, z] != own && any([x, y, z]) {
                        return false;
                    }
                }
            }
        }
        self.cells.entry(own).or_default().push(self.samples.len() as u32);
        self.samples.push(*candidate);
        self.components.push(component);
        true
    }
}

/// Least distance of samples where the free distance above the surface is `clear`, as a share of that on open surfaces. Light changes within a gap over
/// distances like its width.
pub(super) fn share_in_gap(clear: f32, radius: f32, gaps: f32) -> f32 {
    (clear / (PRT_CLEAR * radius)).clamp(gaps, 1.0)
}

/// A sample as the passes of a picture read it. Its weight counts the area, because many samples with small areas in a gap do not count more than others. The
/// powers keep the darkness behind a picture, and the shadow along its frame, away from the wall beside it: a pixel that is seen is rarely in a gap. `radius`:
/// least distance of two samples on a plane, metres.
pub(super) fn for_pictures(sample: &PrtPoint, radius: f32) -> PrtSample {
    let PrtPoint { position, normal, side, area, open, .. } = *sample;
    let part = (PRT_DENSITY * area / (radius * radius)).max(0.03) * open * open;
    PrtSample { position, weight: part * part, normal, side }
}

/// Width of slits without samples, metres.
pub(super) fn slit(radius: f32, gaps: f32) -> f32 {
    if gaps < 1.0 { SLIT * radius } else { 0.0 }
}

/// The radius with which surfaces have so many samples: parts of the surface are given by their areas, m², and the free distances above them, metres.
pub(super) fn radius_for(parts: &[[f32; 2]], samples: u32, gaps: f32) -> f32 {
    let whole: f32 = parts.iter().map(|[area, _]| area).sum();
    let mut radius = (PRT_DENSITY * whole / samples as f32).sqrt();
    // More gaps count as narrow with a larger radius, so the radius approaches its value from below.
    for _ in 0..32 {
        let weighted = parts.iter().map(|[area, clear]| area / share_in_gap(*clear, radius, gaps).powi(2));
        radius = (PRT_DENSITY * weighted.sum::<f32>() / samples as f32).sqrt();
    }
    radius
}

/// A triangle of a scene, and the connected component of its mesh; each instance has components of its own.
pub(super) type Triangle = ([Vec3; 3], u32);

/// The triangles of a scene at rest.
#[derive(Debug, Default)]
pub(super) struct Triangles {
    pub list: Vec<Triangle>,
    /// The first triangle of each instance, in the order of [`crate::resident::Moment::instances`].
    firsts: Vec<u32>,
    /// Hits of particles on the front and on the back of each triangle.
    hits: Vec<[u32; 2]>,
}

impl Triangles {
    /// Surfaces that light does not stop at have no area.
    pub fn new(scene: &Scene) -> Self {
        let pose = Pose::rest(scene);
        let mut out = Self::default();
        let mut first = 0;
        // Instances of a mesh have the same components, each with numbers of its own.
        let mut known: HashMap<(u32, usize), (Vec<u32>, u32)> = HashMap::new();
        for (node, mesh) in scene.nodes.iter().enumerate().filter_map(|(node, of)| Some((node, of.mesh?))) {
            let Some((of, world)) = scene.meshes.get(mesh as usize).zip(pose.world.get(node)) else { continue };
            for (number, primitive) in of.primitives.iter().enumerate() {
                let Some(material) = scene.materials.get(primitive.material as usize) else { continue };
                out.firsts.push(out.list.len() as u32);
                let found = || components(&primitive.positions, &primitive.indices);
                let (components, count) = known.entry((mesh, number)).or_insert_with(found);
                let corner = |index: &u32| match primitive.positions.get(*index as usize) {
                    Some(position) if !material.unlit => world.transform_point3(*position),
                    _ => Vec3::ZERO,
                };
                let triangle = |(t, of): (&[u32], &u32)| ([corner(&t[0]), corner(&t[1]), corner(&t[2])], first + of);
                out.list.extend(primitive.indices.chunks_exact(3).zip(components.iter()).map(triangle));
                first += *count;
            }
        }
        out.hits = vec![[0; 2]; out.list.len()];
        out
    }

    /// The component of the surface that a hit is on.
    pub fn component(&self, hit: &PrtPoint) -> u32 {
        self.find(hit).map_or(0, |(at, _)| self.list[at].1)
    }

    /// The first triangle of each instance, and the component of each triangle.
    pub fn components(&self) -> (&[u32], Vec<u32>) {
        (&self.firsts, self.list.iter().map(|(_, component)| *component).collect())
    }

    /// Forgets all hits.
    pub fn forget(&mut self) {
        self.hits.fill([0; 2]);
    }

    /// Counts the hit of a particle.
    pub fn count(&mut self, hit: &PrtPoint) {
        if let Some((at, back)) = self.find(hit) {
            self.hits[at][usize::from(back)] += 1;
        }
    }

    /// The triangle of a hit, and whether the hit is on its back.
    fn find(&self, hit: &PrtPoint) -> Option<(usize, bool)> {
        let first = self.firsts.get(hit.instance as usize).copied().unwrap_or(0);
        let at = (first + hit.triangle) as usize;
        let (triangle, _) = self.list.get(at)?;
        Some((at, doubled_area(triangle).dot(side(hit)) < 0.0))
    }

    /// Hits on one square metre of the sides that particles meet: the median over hits, which slivers with a hit by chance do not move.
    pub fn usual(&self) -> f64 {
        let sides = self.list.iter().zip(&self.hits).flat_map(|((triangle, _), hits)| {
            let part = (0.5 * f64::from(doubled_area(triangle).length())).max(1e-30);
            hits.iter().map(move |count| (f64::from(*count) / part, *count))
        });
        let mut all: Vec<(f64, u32)> = sides.filter(|(_, count)| *count > 0).collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut half = all.iter().map(|(_, count)| u64::from(*count)).sum::<u64>() / 2;
        let found = all.iter().find(|(_, count)| {
            let here = half < u64::from(*count);
            half = half.saturating_sub((*count).into());
            here
        });
        found.map_or(0.0, |(density, _)| *density)
    }

    /// Whether next to no particle met the front of a triangle. A few slip through the edges of rooms, where two surfaces meet.
    fn is_strange(&self, at: usize, usual: f64) -> bool {
        self.hits[at][0] == 0 || self.are_stray(at, 0, usual)
    }

    /// Whether the hits of a side of a triangle, 1 for its back, are far fewer than those of other surfaces of its size.
    fn are_stray(&self, at: usize, side: usize, usual: f64) -> bool {
        let area = 0.5 * f64::from(doubled_area(&self.list[at].0).length());
        f64::from(self.hits[at][side]) < STRAY * usual * area
    }

    /// Whether a hit is one of a few on its side of a triangle: its particle slipped through an edge into a closed space. `usual`: [`Self::usual`].
    pub fn is_stray(&self, hit: &PrtPoint, usual: f64) -> bool {
        self.find(hit).is_some_and(|(at, back)| self.are_stray(at, back.into(), usual))
    }

    /// Whether a hit is on the front of a triangle that particles do not meet. `usual`: [`Self::usual`].
    pub fn is_new(&self, hit: &PrtPoint, usual: f64) -> bool {
        self.find(hit).is_some_and(|(at, back)| !back && self.is_strange(at, usual))
    }

    /// Up to `count` points, evenly distributed over the fronts of triangles that particles do not meet, with the normals there.
    pub fn unseen(&self, count: usize, usual: f64) -> Vec<[Vec3; 2]> {
        let strange = (0..self.list.len()).filter(|at| self.is_strange(*at, usual));
        let strange: Vec<&[Vec3; 3]> = strange.map(|at| &self.list[at].0).collect();
        let fronts = || strange.iter().copied();
        let part = |triangle: &[Vec3; 3]| 0.5 * f64::from(doubled_area(triangle).length());
        let each = fronts().map(part).filter(|part| part.is_finite()).sum::<f64>() / count as f64;
        let mut out: Vec<[Vec3; 2]> = Vec::new();
        let mut sum = 0.0;
        for triangle in fronts().filter(|triangle| part(triangle).is_finite() && each > 0.0) {
            sum += part(triangle) / each;
            while out.len() as f64 + 0.5 < sum {
                let [a, b, c] = triangle;
                let uv = quasi(out.len() as u64 + 1);
                out.push([*a + (*b - *a) * uv.x + (*c - *a) * uv.y, doubled_area(triangle).normalize()]);
            }
        }
        out
    }

    /// Whether particles reach each side of each triangle, more than a few stray ones; `None`: the side is so small that they may have missed it by chance.
    fn reached(&self) -> Vec<[Option<bool>; 2]> {
        let parts: Vec<f64> = self.list.iter().map(|(t, _)| 0.5 * f64::from(doubled_area(t).length())).collect();
        let (mut all, mut of_hit) = (0.0, 0.0);
        for (hits, part) in self.hits.iter().zip(&parts) {
            for count in hits.iter().filter(|count| **count > 0) {
                all += f64::from(*count);
                of_hit += part;
            }
        }
        let density = if of_hit > 0.0 { all / of_hit } else { 0.0 };
        let usual = self.usual();
        let reached = |at: usize, side: usize| match self.hits[at][side] {
            // Corners have fewer hits than open walls, and some have none by chance.
            0 if parts[at] * density < 20.0 => None,
            count => Some(count > 0 && !self.are_stray(at, side, usual)),
        };
        (0..self.list.len()).map(|at| [0, 1].map(|side| reached(at, side))).collect()
    }
}

fn doubled_area([a, b, c]: &[Vec3; 3]) -> Vec3 {
    (*b - *a).cross(*c - *a)
}

/// Least and greatest coordinates of triangles, metres.
pub(super) fn bounds(triangles: &[Triangle]) -> [Vec3; 2] {
    let corners = || triangles.iter().flat_map(|(triangle, _)| *triangle);
    [corners().fold(Vec3::splat(f32::MAX), Vec3::min), corners().fold(Vec3::splat(f32::MIN), Vec3::max)]
}

/// Area of triangles, m².
pub(super) fn area(triangles: &[Triangle]) -> f64 {
    triangles.iter().map(|(t, _)| 0.5 * f64::from(doubled_area(t).length())).filter(|area| area.is_finite()).sum()
}

/// Barycentrics of the second and the third corner of a point in a triangle: a low-discrepancy sequence (Roberts, The Unreasonable Effectiveness of
/// Quasirandom Sequences, 2018).
fn quasi(number: u64) -> Vec2 {
    let fraction = |by: f64| (0.5 + by * number as f64).fract() as f32;
    let uv = Vec2::new(fraction(0.754_877_666_246_693), fraction(0.569_840_290_998_053));
    if uv.x + uv.y > 1.0 { 1.0 - uv } else { uv }
}

/// Gives each sample the area of the surface that is nearest to it. Sides that no particle reached have no samples and count for none. `radius`, `shares`:
/// as for [`Nearby::new`].
pub(super) fn weigh(samples: &mut [PrtPoint], triangles: &Triangles, radius: f32, shares: &[f32]) {
    let nearby = Nearby::new(samples, radius, shares);
    let components: Vec<u32> = samples.iter().map(|sample| triangles.component(sample)).collect();
    let whole = area(&triangles.list);
    let reached = triangles.reached();
    let each = whole / (POINTS * samples.len().max(1)) as f64;
    let mut counts = vec![0u32; samples.len()];
    let (mut sum, mut number) = (0.0f64, 0u64);
    for ((triangle, component), reached) in triangles.list.iter().zip(&reached) {
        let normal = doubled_area(triangle);
        let part = 0.5 * f64::from(normal.length());
        if !part.is_finite() || part <= 0.0 || each <= 0.0 {
            continue;
        }
        sum += part / each;
        let normal = normal.normalize();
        while (number as f64) + 0.5 < sum {
            number += 1;
            let uv = quasi(number);
            let [a, b, c] = triangle;
            let at = *a + (*b - *a) * uv.x + (*c - *a) * uv.y;
            for (normal, reached) in [normal, -normal].into_iter().zip(reached) {
                let found = if *reached == Some(false) {
                    None
                } else {
                    nearby.nearest((samples, &components), at, normal, *component)
                };
                let Some(found) = found else { continue };
                // A side that is too small for hits belongs to a sample of the same plane.
                let sample = &samples[found];
                let off = (position(sample) - at).dot(normal).abs();
                if reached.is_some() || off < 0.1 * radius && side(sample).dot(normal) > 0.7 {
                    counts[found] += 1;
                }
            }
        }
    }
    for (sample, count) in samples.iter_mut().zip(counts) {
        // Each side of a triangle has its whole area.
        sample.area = (f64::from(count) * each) as f32;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(at: Vec3, side: Vec3) -> PrtPoint {
        PrtPoint { position: at.to_array(), side: side.to_array(), normal: side.to_array(), ..PrtPoint::default() }
    }

    /// Samples on a square of one metre, and its triangles.
    fn square(radius: f32) -> (Vec<PrtPoint>, Triangles) {
        let mut thinning = Thinning::new(radius, 1.0);
        for i in 0..60_000u32 {
            let fraction = |by: f64| (0.5 + by * f64::from(i)).fract() as f32;
            let at = Vec3::new(fraction(0.754_877_666_246_693), 0.0, fraction(0.569_840_290_998_053));
            thinning.offer(&point(at, Vec3::Y), 0);
        }
        let [a, b, c, d] = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, z)| Vec3::new(x, 0.0, z));
        // Seen from its upper side, which is the back of these triangles.
        let list = vec![([a, b, c], 0), ([a, c, d], 0)];
        (thinning.samples, Triangles { list, firsts: vec![0], hits: vec![[0, 1000]; 2] })
    }

    #[test]
    fn samples_are_apart_and_fill_a_plane() {
        let (samples, _) = square(0.05);
        for (index, a) in samples.iter().enumerate() {
            assert!(samples[..index].iter().all(|b| position(a).distance(position(b)) >= 0.05));
        }
        let wanted = PRT_DENSITY / 0.05f32.powi(2);
        // Quasi-random candidates and the border of the square add some.
        assert!((samples.len() as f32 / wanted - 1.0).abs() < 0.15, "{} {wanted}", samples.len());
    }

    #[test]
    fn a_few_stray_hits_do_not_make_a_room_known() {
        let (_, mut triangles) = square(0.05);
        triangles.list.push(([Vec3::Y, Vec3::Y + Vec3::X, Vec3::Y + Vec3::Z], 0));
        triangles.list.push(([Vec3::Z, Vec3::Z + Vec3::X, Vec3::Z + 1e-9 * Vec3::Y], 0));
        triangles.hits.extend([[19, 0], [1, 0]]);
        // The fronts of the square have no hits, their backs have 2000 of one square metre.
        assert_eq!(triangles.usual(), 2000.0);
        let strange = |triangles: &Triangles| (0..4).map(|at| triangles.is_strange(at, 2000.0)).collect::<Vec<_>>();
        assert_eq!(strange(&triangles), [true, true, true, false]);
        let hit = |triangle: u32, side: Vec3| PrtPoint { triangle, ..point(Vec3::Y, side) };
        let stray = |triangles: &Triangles, triangle, side| triangles.is_stray(&hit(triangle, side), 2000.0);
        // The square has hits on its back alone, and the triangle above it has few on both sides.
        assert!(!stray(&triangles, 0, Vec3::Y) && stray(&triangles, 0, Vec3::NEG_Y));
        assert!(stray(&triangles, 2, Vec3::Y) && stray(&triangles, 2, Vec3::NEG_Y));
        assert_eq!(triangles.reached()[..3], [[Some(false), Some(true)], [Some(false), Some(true)], [Some(false); 2]]);
        triangles.hits[2] = [21, 0];
        assert!(!stray(&triangles, 2, Vec3::NEG_Y));
        assert_eq!(triangles.reached()[2], [Some(true), Some(false)]);
        assert_eq!(strange(&triangles), [true, true, false, false]);
        assert!(triangles.unseen(100, 2000.0).iter().all(|[at, _]| at.y == 0.0));
        assert_eq!(Triangles::default().usual(), 0.0);
    }

    #[test]
    fn areas_sum_to_the_surface_and_only_to_its_lit_side() {
        let (mut samples, triangles) = square(0.05);
        weigh(&mut samples, &triangles, 0.05, &[]);
        let whole: f32 = samples.iter().map(|sample| sample.area).sum();
        assert!((whole - 1.0).abs() < 1e-3, "{whole}");
        let mean = 1.0 / samples.len() as f32;
        assert!(samples.iter().all(|sample| sample.area > 0.3 * mean && sample.area < 3.0 * mean));
    }

    #[test]
    fn two_sides_of_a_sheet_have_samples_of_their_own() {
        let mut thinning = Thinning::new(0.1, 1.0);
        assert!(thinning.offer(&point(Vec3::ZERO, Vec3::Y), 0));
        assert!(thinning.offer(&point(Vec3::ZERO, -Vec3::Y), 0));
        assert!(!thinning.offer(&point(Vec3::X * 0.09, Vec3::Y), 0));
        assert!(thinning.offer(&point(Vec3::X * 0.09, Vec3::Z), 0));
        // The neighbour of another component is nearer than that, but not too near.
        assert!(!thinning.offer(&point(Vec3::X * -0.05, Vec3::Y), 1));
        assert!(thinning.offer(&point(Vec3::X * -0.07, Vec3::Y), 1));
    }

    /// Hits on two planes with a distance between them, which face each other; their areas are the free distances.
    fn hits(apart: f32) -> impl Iterator<Item = PrtPoint> {
        (0..40_000u32).map(move |i| {
            let fraction = |by: f64| (0.5 + by * f64::from(i)).fract() as f32;
            let at = Vec3::new(fraction(0.754_877_666_246_693), 0.0, fraction(0.569_840_290_998_053));
            let (at, side) = if i % 2 == 0 { (at, Vec3::Y) } else { (at + apart * Vec3::Y, -Vec3::Y) };
            PrtPoint { area: apart, ..point(at, side) }
        })
    }

    #[test]
    fn gaps_have_more_samples_and_slits_have_none() {
        let count = |apart: f32| {
            let mut thinning = Thinning::new(0.1, 0.4);
            hits(apart).for_each(|hit| {
                thinning.offer(&hit, 0);
            });
            thinning.samples.len() as f32
        };
        let open = count(0.5);
        // Half of two distances of samples is free; then less than the least share.
        assert!((count(0.1) / open - 4.0).abs() < 0.6, "{} {open}", count(0.1));
        assert!((count(0.02) / open - 1.0 / 0.16).abs() < 1.2, "{} {open}", count(0.02));
        assert_eq!(count(0.004), 0.0);
        assert!(Thinning::new(0.1, 1.0).offer(&hits(0.004).next().unwrap(), 0));
    }

    #[test]
    fn steps_have_samples_on_both_planes_and_curved_surfaces_do_not_count_as_steps() {
        let mut thinning = Thinning::new(0.1, 1.0);
        assert!(thinning.offer(&point(Vec3::ZERO, Vec3::Y), 0));
        assert!(!thinning.offer(&point(Vec3::new(0.05, 0.005, 0.0), Vec3::Y), 0));
        assert!(thinning.offer(&point(Vec3::new(0.05, 0.02, 0.0), Vec3::Y), 0));
        // On a sphere of 0.3 m, 9 cm away.
        let on_sphere = |angle: f32| {
            point(0.3 * Vec3::new(angle.sin(), angle.cos(), 0.0), Vec3::new(angle.sin(), angle.cos(), 0.0))
        };
        let mut thinning = Thinning::new(0.1, 1.0);
        assert!(
            thinning.offer(&on_sphere(0.0), 0)
                && !thinning.offer(&on_sphere(0.3), 0)
                && thinning.offer(&on_sphere(0.35), 0)
        );
    }

    #[test]
    fn the_radius_suits_the_number_of_samples() {
        let open = radius_for(&[[10.0, 1e9]], 1000, 0.4);
        assert!((PRT_DENSITY * 10.0 / open.powi(2) - 1000.0).abs() < 0.1);
        // All of it in gaps of half the least distance: samples are as close as they may.
        let narrow = radius_for(&[[10.0, 0.5 * open]], 1000, 0.4);
        assert!((narrow / open - 2.5).abs() < 1e-3, "{narrow} {open}");
        let mixed = radius_for(&[[5.0, 1e9], [5.0, 0.0]], 1000, 0.4);
        assert!((PRT_DENSITY * (5.0 + 5.0 / 0.16) / mixed.powi(2) - 1000.0).abs() < 0.1);
    }
}
