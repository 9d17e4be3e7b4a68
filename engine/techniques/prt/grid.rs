//! Cells in which the samples around a point are found.

use glam::{IVec3, UVec3, Vec3};
use half::f16;

use super::samples::{position, side};
use crate::shaders::{
    consts::{PRT_STEP, PRT_STRANGE},
    types::{PrtCandidate, PrtGrid, PrtPoint},
};

/// Cells of a grid at most.
const MOST_CELLS: f64 = 8e6;

/// Samples in cells of two distances of samples: each sample is in one cell.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    pub grid: PrtGrid,
    /// First entry of `order` of each cell, and its end.
    pub starts: Vec<u32>,
    /// Numbers of samples, cell after cell.
    pub order: Vec<u32>,
}

impl Grid {
    /// `radius`: least distance of two samples on a plane, metres.
    pub fn new(samples: &[PrtPoint], radius: f32) -> Self {
        let grid = cells(samples, 2.0 * radius, 0.0, radius);
        let cell = |sample: &PrtPoint| {
            let (at, counts) = (place(&grid, position(sample)), UVec3::from(grid.counts));
            number(&grid, at.max(Vec3::ZERO).as_uvec3().min(counts - 1))
        };
        let (starts, order) = listed(&grid, samples.iter().enumerate().map(|(number, sample)| (cell(sample), number)));
        Self { grid, starts, order }
    }
}

/// For each cell of space all samples that may be the nearest one of a point in the cell.
#[derive(Clone, Debug, PartialEq)]
pub struct Nearby {
    pub grid: PrtGrid,
    /// First entry of `order` of each cell, and its end.
    pub starts: Vec<u32>,
    /// Numbers of samples, cell after cell. A sample is in the lists of all cells within its reach.
    pub order: Vec<u32>,
    /// Least distance of samples around each sample, as a share of that on open surfaces; empty: 1.
    shares: Vec<f32>,
}

impl Nearby {
    /// `radius`: least distance of two samples on a plane, metres. `shares`: that around each sample, as a share of it; empty: 1.
    pub fn new(samples: &[PrtPoint], radius: f32, shares: &[f32]) -> Self {
        let grid = cells(samples, radius, radius, radius);
        let counts = UVec3::from(grid.counts).as_ivec3();
        let around = |(sample, at): (usize, Vec3)| {
            // A point is no farther from the next sample than the least distance if all places are filled. Gaps are not, so half as much is added.
            let share = shares.get(sample).map_or(1.0, |share| (1.5 * share).min(1.0));
            let reach = share * radius / grid.cell;
            let [low, high] = [-reach, reach].map(|by| (at + by).floor().as_ivec3().clamp(IVec3::ZERO, counts - 1));
            let near = move |cell: &IVec3| {
                let corner = cell.as_vec3();
                at.distance_squared(at.clamp(corner, corner + 1.0)) <= reach * reach
            };
            (low.z..=high.z)
                .flat_map(move |z| (low.y..=high.y).map(move |y| (y, z)))
                .flat_map(move |(y, z)| (low.x..=high.x).map(move |x| IVec3::new(x, y, z)))
                .filter(near)
                .map(move |cell| (number(&grid, cell.as_uvec3()), sample))
        };
        let places = samples.iter().enumerate().map(|(number, sample)| (number, place(&grid, position(sample))));
        let (starts, order) = listed(&grid, places.flat_map(around));
        Self { grid, starts, order, shares: shares.to_vec() }
    }

    /// The sample that stands for a point of a surface. Like `nearest_sample` of `prt/find.glsl`, but without neighbouring cells; the free distance above the
    /// point is not known.
    pub fn nearest(
        &self,
        (samples, components): (&[PrtPoint], &[u32]),
        at: Vec3,
        normal: Vec3,
        component: u32,
    ) -> Option<usize> {
        let place = place(&self.grid, at);
        if place.min_element() < 0.0 || place.cmpge(UVec3::from(self.grid.counts).as_vec3()).any() {
            return None;
        }
        let cell = number(&self.grid, place.as_uvec3());
        let mut found = None;
        let mut least = f32::MAX;
        for number in &self.order[self.starts[cell] as usize..self.starts[cell + 1] as usize] {
            let sample = &samples[*number as usize];
            let facing = side(sample).dot(normal);
            let way = position(sample) - at;
            let off = way.dot((side(sample) + normal).normalize_or_zero());
            let turned = if facing > 0.9 { 1.0 } else { 3.0 - 2.0 * facing };
            let strange = if components[*number as usize] == component { 1.0 } else { PRT_STRANGE };
            // An open surface beside a gap belongs to its own samples, not to closer ones in the gap.
            let share = self.shares.get(*number as usize).copied().unwrap_or(1.0);
            let score = (way.length_squared() + PRT_STEP * off * off) * turned * strange / (share * share);
            // A sample far away or on a parallel surface does not stand for this one.
            let apart = off.abs().max(0.25 * way.length()) > 0.5 * self.grid.radius;
            if facing > 0.3 && !apart && score < least {
                (least, found) = (score, Some(*number as usize));
            }
        }
        found
    }
}

/// The samples for `prt/find.glsl`, with the components of their surfaces. `clearances`: free distances above them, at most `most`, metres.
pub(super) fn packed(samples: &[PrtPoint], components: &[u32], clearances: &[f32], most: f32) -> Vec<PrtCandidate> {
    let of = |((sample, component), clear): ((&PrtPoint, &u32), &f32)| {
        let [u, v] = octahedral(side(sample)).map(|value| u32::from((value * 32767.0).round() as i16 as u16));
        let clear = u32::from(f16::from_f32(clear / most).to_bits());
        PrtCandidate { position: sample.position, side: u | v << 16, surface: (component & 0xffff) | clear << 16 }
    };
    samples.iter().zip(components).zip(clearances).map(of).collect()
}

/// A direction as a point of a square, −1 to 1. Twin of `octahedral_encode` of `lib/gbuffer.glsl`.
fn octahedral(way: Vec3) -> [f32; 2] {
    let p = way / way.abs().element_sum().max(1e-30);
    let sign = |value: f32| if value >= 0.0 { 1.0 } else { -1.0 };
    match p.z >= 0.0 {
        true => [p.x, p.y],
        false => [(1.0 - p.y.abs()) * sign(p.x), (1.0 - p.x.abs()) * sign(p.y)],
    }
}

/// Cells of at least this size that cover all samples and a margin around them, metres.
fn cells(samples: &[PrtPoint], cell: f32, margin: f32, radius: f32) -> PrtGrid {
    let (mut low, mut high) = (Vec3::splat(f32::MAX), Vec3::splat(f32::MIN));
    for sample in samples {
        (low, high) = (low.min(position(sample)), high.max(position(sample)));
    }
    if samples.is_empty() {
        (low, high) = (Vec3::ZERO, Vec3::ZERO);
    }
    (low, high) = (low - margin, high + margin);
    let size = (high - low).as_dvec3();
    let mut cell = f64::from(cell).max(1e-6);
    while (size / cell + 1.0).element_product() > MOST_CELLS {
        cell *= 1.25;
    }
    let counts = (size / cell).floor().as_uvec3() + 1;
    PrtGrid { origin: low.to_array(), cell: cell as f32, counts: counts.to_array(), radius }
}

/// A point in cells.
fn place(grid: &PrtGrid, at: Vec3) -> Vec3 {
    (at - Vec3::from(grid.origin)) / grid.cell
}

fn number(grid: &PrtGrid, cell: UVec3) -> usize {
    let counts = UVec3::from(grid.counts);
    ((cell.z * counts.y + cell.y) * counts.x + cell.x) as usize
}

/// The first entry of each cell, and the entries cell after cell, of pairs of a cell and a sample.
fn listed(grid: &PrtGrid, pairs: impl Iterator<Item = (usize, usize)> + Clone) -> (Vec<u32>, Vec<u32>) {
    let mut starts = vec![0u32; UVec3::from(grid.counts).element_product() as usize + 1];
    pairs.clone().for_each(|(cell, _)| starts[cell + 1] += 1);
    for cell in 1..starts.len() {
        starts[cell] += starts[cell - 1];
    }
    let mut next = starts.clone();
    let mut order = vec![0u32; starts.last().copied().unwrap_or(0) as usize];
    for (cell, sample) in pairs {
        order[next[cell] as usize] = sample as u32;
        next[cell] += 1;
    }
    (starts, order)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points of a low-discrepancy sequence in a box, with normals along the axes.
    fn points(count: u32) -> Vec<PrtPoint> {
        let fraction = |i: u32, by: f64| (0.5 + by * f64::from(i)).fract() as f32;
        let of = |i: u32| {
            let [x, y, z] =
                [0.819_172_513_396_164, 0.671_043_606_703_789, 0.549_700_477_901_97].map(|by| fraction(i, by));
            let side = [Vec3::X, Vec3::Y, Vec3::Z][i as usize % 3];
            PrtPoint { position: [3.0 * x, y, 2.0 * z], side: side.to_array(), ..PrtPoint::default() }
        };
        (0..count).map(of).collect()
    }

    #[test]
    fn each_sample_is_in_one_cell_of_its_grid() {
        let samples = points(500);
        let grid = Grid::new(&samples, 0.1);
        let mut order = grid.order.clone();
        order.sort_unstable();
        assert!(order.iter().copied().eq(0..500));
        assert_eq!(*grid.starts.last().unwrap(), 500);
    }

    #[test]
    fn lists_have_all_samples_within_the_radius_and_none_far_away() {
        let samples = points(500);
        for radius in [0.05, 0.3, 5.0] {
            let nearby = Nearby::new(&samples, radius, &[]);
            for at in points(200).iter().map(position) {
                let at = at + 0.5 * radius * Vec3::new(1.0, -0.3, 0.2);
                let cell = number(&nearby.grid, place(&nearby.grid, at).max(Vec3::ZERO).as_uvec3());
                let list = &nearby.order[nearby.starts[cell] as usize..nearby.starts[cell + 1] as usize];
                for (number, sample) in samples.iter().enumerate() {
                    let away = position(sample).distance(at);
                    let listed = list.contains(&(number as u32));
                    assert!(listed || away > 0.999 * radius, "{number} is {away} away");
                    assert!(!listed || away < 2.8 * radius, "{number} is {away} away");
                }
            }
        }
    }

    #[test]
    fn open_surfaces_beside_a_gap_belong_to_their_own_samples() {
        let at = |x: f32| PrtPoint { position: [x, 0.0, 0.0], side: [0.0, 1.0, 0.0], ..PrtPoint::default() };
        let samples = [at(0.0), at(0.1)];
        let nearest = |x: f32, shares: &[f32]| {
            Nearby::new(&samples, 0.1, shares).nearest((&samples, &[0; 2]), x * Vec3::X, Vec3::Y, 0)
        };
        assert_eq!([0.04, 0.06].map(|x| nearest(x, &[])), [Some(0), Some(1)]);
        // The second sample is in a gap.
        assert_eq!([0.06, 0.09].map(|x| nearest(x, &[1.0, 0.4])), [Some(0), Some(1)]);
    }

    #[test]
    fn a_point_prefers_samples_of_its_own_component() {
        let at = |x: f32| PrtPoint { position: [x, 0.0, 0.0], side: [0.0, 1.0, 0.0], ..PrtPoint::default() };
        let samples = [at(0.0), at(0.05)];
        let nearby = Nearby::new(&samples, 0.1, &[]);
        let nearest = |component| nearby.nearest((&samples, &[3, 4]), 0.035 * Vec3::X, Vec3::Y, component);
        assert_eq!([3, 4, 5].map(nearest), [Some(0), Some(1), Some(1)]);
    }

    #[test]
    fn packed_samples_keep_their_sides_and_free_distances() {
        let samples = points(30);
        for (sample, near) in samples.iter().zip(packed(&samples, &[7; 30], &[0.03; 30], 0.2)) {
            let words =
                [near.side as u16 as i16, (near.side >> 16) as u16 as i16].map(|word| f32::from(word) / 32767.0);
            assert_eq!((near.position, words), (sample.position, octahedral(side(sample))));
            assert_eq!(near.surface & 0xffff, 7);
            assert!((f16::from_bits((near.surface >> 16) as u16).to_f32() - 0.15).abs() < 1e-4);
        }
        assert_eq!(octahedral(-Vec3::Z).map(f32::abs), [1.0, 1.0]);
    }

    #[test]
    fn points_outside_of_all_cells_have_no_sample() {
        let samples = points(50);
        let nearby = Nearby::new(&samples, 0.1, &[]);
        assert_eq!(nearby.nearest((&samples, &[0; 50]), Vec3::splat(-9.0), Vec3::X, 0), None);
        assert_eq!(nearby.nearest((&samples, &[0; 50]), Vec3::splat(9.0), Vec3::X, 0), None);
        let at = position(&samples[7]);
        assert_eq!(nearby.nearest((&samples, &[0; 50]), at, side(&samples[7]), 0), Some(7));
        assert_eq!(Nearby::new(&[], 0.1, &[]).nearest((&[], &[]), Vec3::ZERO, Vec3::X, 0), None);
    }
}
