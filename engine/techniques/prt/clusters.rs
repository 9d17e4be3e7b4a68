//! Clusters of samples (Leonhardt and Bohn, section 4.1).

use glam::Vec3;

use super::{
    Baking,
    samples::{position, side},
};
use crate::shaders::types::PrtPoint;

/// Sorts samples by clusters, and returns the number of samples of each. Samples are split into two groups where their places and their normals differ
/// most, until groups are small enough. The paper grows clusters around particles instead; groups by splits have more even sizes and normals that agree.
pub(super) fn cluster(mut samples: Vec<PrtPoint>, baking: &Baking) -> (Vec<PrtPoint>, Vec<u32>) {
    let wanted = (samples.len() as f32 / baking.cluster as f32).round().max(1.0) as usize;
    let whole: f32 = samples.iter().map(|sample| sample.area).sum();
    // Side of a square cluster.
    let size = (whole / wanted as f32).sqrt();
    let mut counts = Vec::with_capacity(wanted);
    let mut open = vec![(0..samples.len(), wanted)];
    while let Some((range, wanted)) = open.pop() {
        let group = &mut samples[range.clone()];
        if wanted < 2 || group.len() < 2 {
            // Neighbours that look alike lie side by side: rays of neighbours take the same ways through the tree of triangles.
            group.sort_by_cached_key(|sample| (half_axis(side(sample)), along_curve(position(sample), size)));
            counts.push(range.len() as u32);
            continue;
        }
        let (first, parts) = split(group, wanted, 1.25 * size);
        let middle = range.start + first;
        open.push((middle..range.end, wanted - parts));
        open.push((range.start..middle, parts));
    }
    counts.retain(|count| *count > 0);
    (samples, counts)
}

/// Sorts samples into two groups. Returns the number of samples of the first one, and its part of the clusters that are wanted. `turn`: length that
/// counts as much as a turn of the normal by 60°, metres.
fn split(samples: &mut [PrtPoint], wanted: usize, turn: f32) -> (usize, usize) {
    let of = |sample: &PrtPoint, axis: usize| match axis {
        0..3 => f64::from(sample.position[axis]),
        _ => f64::from(turn * sample.side[axis - 3]),
    };
    let count = samples.len();
    let spread = |axis: usize| {
        let mean = samples.iter().map(|sample| of(sample, axis)).sum::<f64>() / count as f64;
        samples.iter().map(|sample| (of(sample, axis) - mean).powi(2)).sum::<f64>()
    };
    let spreads: Vec<f64> = (0..6).map(spread).collect();
    let axis = (0..6).max_by(|a, b| spreads[*a].total_cmp(&spreads[*b])).unwrap_or(0);
    samples.sort_by(|a, b| of(a, axis).total_cmp(&of(b, axis)));
    // Where the spread within both groups is least: there the sum of the squared means times the numbers is largest.
    let whole: f64 = samples.iter().map(|sample| of(sample, axis)).sum();
    // Neither group is much smaller than a cluster.
    let least = (7 * count / (10 * wanted)).clamp(1, count / 2);
    let (low, high) = (least, count - least);
    let mut best = (f64::NEG_INFINITY, count / 2);
    let mut sum = 0.0;
    for (index, sample) in samples.iter().enumerate() {
        if index >= low && index <= high {
            let apart = sum * sum / index as f64 + (whole - sum).powi(2) / (count - index) as f64;
            if apart > best.0 {
                best = (apart, index);
            }
        }
        sum += of(sample, axis);
    }
    let first = best.1.clamp(1, count - 1);
    let parts = (wanted as f64 * first as f64 / count as f64).round() as usize;
    (first, parts.clamp(1, wanted - 1))
}

/// Number of the half axis that is nearest to a direction.
fn half_axis(way: Vec3) -> usize {
    let axis = way.abs().max_position();
    2 * axis + usize::from(way[axis] < 0.0)
}

/// Place on Morton's curve, in steps of a sixteenth of a size, metres.
fn along_curve(at: Vec3, size: f32) -> u64 {
    let steps = (16.0 * at / size.max(1e-6)).floor().as_i64vec3() + (1 << 19);
    let bits = |value: i64| (0..20).map(|bit| ((value.max(0) as u64 >> bit) & 1) << (3 * bit)).sum::<u64>();
    bits(steps.x) | bits(steps.y) << 1 | bits(steps.z) << 2
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3Swizzles;

    fn point(at: Vec3, side: Vec3) -> PrtPoint {
        PrtPoint { position: at.to_array(), side: side.to_array(), area: 1.0, ..PrtPoint::default() }
    }

    #[test]
    fn samples_that_look_at_each_other_are_one_cluster_if_one_is_wanted() {
        let ways = [Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y];
        let samples: Vec<PrtPoint> = ways.iter().map(|way| point(-*way, *way)).collect();
        for (size, clusters) in [(8, 1), (4, 1), (2, 2)] {
            let (sorted, counts) = cluster(samples.clone(), &Baking { cluster: size, ..Baking::default() });
            assert_eq!((sorted.len(), counts.len()), (4, clusters), "{size}: {counts:?}");
        }
    }

    /// The sides of boxes in a row, with their normals outwards.
    fn boxes() -> Vec<PrtPoint> {
        let sides = [Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z];
        let of = |(number, place): (usize, usize)| {
            let (side, at) = (sides[number % 6], (number / 6) as f32);
            point(side + Vec3::X * (4.0 * place as f32) + 0.01 * at * side.zxy(), side)
        };
        (0..4).flat_map(|place| (0..120).map(move |number| (number, place))).map(of).collect()
    }

    #[test]
    fn clusters_have_all_samples_once_and_similar_sizes() {
        let samples = boxes();
        let (sorted, counts) = cluster(samples.clone(), &Baking { cluster: 40, ..Baking::default() });
        let places = |list: &[PrtPoint]| {
            let mut all: Vec<[u32; 3]> = list.iter().map(|sample| sample.position.map(f32::to_bits)).collect();
            all.sort_unstable();
            all
        };
        assert_eq!(places(&sorted), places(&samples));
        assert_eq!((counts.len(), counts.iter().sum::<u32>()), (12, 480));
        assert!(counts.iter().all(|count| (20..=80).contains(count)), "{counts:?}");
    }

    #[test]
    fn normals_of_a_cluster_agree_where_there_are_enough_clusters() {
        let (sorted, counts) = cluster(boxes(), &Baking { cluster: 20, ..Baking::default() });
        let mut first = 0;
        let mut turned = 0;
        for count in &counts {
            let group = &sorted[first..first + *count as usize];
            turned += group.iter().filter(|sample| side(sample).dot(side(&group[0])) < 0.5).count();
            first += *count as usize;
        }
        assert!(turned * 10 < sorted.len(), "{turned} of {}", sorted.len());
    }
}
