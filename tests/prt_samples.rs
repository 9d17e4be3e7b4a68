//! Samples on surfaces are even: nearest neighbours, spectrum, densities and areas.

use std::f64::consts::PI;

use crate::{
    prt_lab::{closed, sampled, small},
    tracer_lab::Stage,
};
use glam::{DVec3, Vec3, vec3};
use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    scene::{Material, Scene},
    shaders::types::PrtPoint,
    techniques::prt::{Baking, Sampled},
};

/// Rings of triangles of the sphere.
const RINGS: u32 = 48;
/// Samples of random sequential adsorption on a plane whose least distance is 1, of one square metre, when no further sample fits in: discs of
/// half that radius cover 0.547 of the plane (Feder, Random sequential adsorption, 1980).
const JAMMED: f64 = 0.547 * 4.0 / PI;

/// The inside of a sphere of 1 m with a lamp in it.
fn sphere() -> Scene {
    let mut stage = Stage::new();
    let wall = stage.material(Material::diffuse("wall", Vec3::splat(0.5)));
    stage.sphere(wall, Vec3::ZERO, 1.0, RINGS, true);
    stage.point(vec3(0.2, 0.3, -0.1), Vec3::ONE);
    stage.scene
}

fn points(gpu: &Gpu, scene: &Scene, samples: u32) -> (f64, Vec<PrtPoint>) {
    let Sampled { plan, samples, .. } = sampled(gpu, scene, &Baking { samples, ..small() }).unwrap().1;
    (f64::from(plan.radius), samples)
}

fn at(point: &PrtPoint) -> DVec3 {
    Vec3::from(point.position).as_dvec3()
}

/// The distance of each point to the nearest other one.
fn nearest(points: &[DVec3]) -> Vec<f64> {
    let of = |i: usize| {
        let others = points.iter().enumerate().filter(|(j, _)| *j != i);
        others.map(|(_, other)| other.distance(points[i])).fold(f64::MAX, f64::min)
    };
    (0..points.len()).map(of).collect()
}

/// Mean, and standard deviation relative to the mean.
fn spread(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    (mean, (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / count).sqrt() / mean)
}

/// Checks the distances of nearest neighbours on a surface without an edge. When no further sample fits in, every point of the surface is within
/// one radius r of a sample, so they are in r to 2 r. A distribution on that range with the mean m has a variance of (m − r)(2 r − m) at most
/// (Bhatia and Davis 2000), so its coefficient of variation is below 0.354. Random points have √(4/π − 1) = 0.523.
fn check_neighbours(points: &[PrtPoint], least: f64, radius: f64) {
    // A way off the tangent plane counts eight times (`PRT_STEP`). The facets of a sphere are such steps.
    let counted = |a: &PrtPoint, b: &PrtPoint| {
        let normal = (Vec3::from(a.side) + Vec3::from(b.side)).as_dvec3().normalize_or_zero();
        let way = at(b) - at(a);
        (way.length_squared() + 64.0 * way.dot(normal).powi(2)).sqrt()
    };
    for (number, a) in points.iter().enumerate() {
        assert!(points[..number].iter().all(|b| counted(a, b) >= 0.999 * least), "{number}: {least}");
    }
    let distances = nearest(&points.iter().map(at).collect::<Vec<_>>());
    let far = distances.iter().filter(|d| **d > 2.0 * radius).count();
    assert!(far as f64 <= 0.005 * distances.len() as f64, "{far} of {}", distances.len());
    let (mean, variation) = spread(&distances);
    let bound = ((mean - least) * (2.0 * radius - mean)).sqrt() / mean;
    assert!(mean > least && variation < bound && bound < 0.36, "{variation}, at most {bound}");
}

#[test]
fn samples_of_a_sphere_have_even_distances_and_a_blue_spectrum() {
    with_gpu(|gpu| {
        let (radius, samples) = points(gpu, &sphere(), 2000);
        let places: Vec<DVec3> = samples.iter().map(at).collect();
        let count = places.len() as f64;
        // The fluctuation of the number is far below that of random points, 1/√n = 2 %.
        let wanted = JAMMED * 4.0 * PI / radius.powi(2);
        assert!((count / wanted - 1.0).abs() < 0.03, "{count} instead of {wanted}");
        // On a sphere of radius 1 the least distance shrinks by d²/4, the normals of facets differ by up to one facet.
        let facet = PI / f64::from(RINGS);
        check_neighbours(&samples, radius * (1.0 - 0.25 * (radius + facet).powi(2)), radius);
        // Squares of distances of random points on a sphere are evenly distributed in 0 to 4, so pairs of each distance can be counted.
        let mut pairs = [0.0f64; 40];
        for (i, a) in places.iter().enumerate() {
            for b in &places[..i] {
                let bin = (a.distance(*b) / (0.25 * radius)) as usize;
                if let Some(pairs) = pairs.get_mut(bin) {
                    *pairs += 1.0;
                }
            }
        }
        let all = 0.5 * count * (count - 1.0);
        let density: Vec<f64> = (0..40)
            .map(|bin| {
                let square = |edge: usize| (0.25 * radius * edge as f64).powi(2);
                pairs[bin] / (all * (square(bin + 1) - square(bin)) / 4.0)
            })
            .collect();
        assert!(density[..3].iter().all(|d| *d == 0.0) && density[4] > 1.3, "{density:?}");
        // Farther than four radii, samples know nothing of each other. A bin has some thousand pairs: 4 deviations.
        for (bin, density) in density.iter().enumerate().skip(16) {
            let expected = all * (0.25 * radius).powi(2) * (2.0 * bin as f64 + 1.0) / 4.0;
            assert!((density - 1.0).abs() < 4.0 / expected.sqrt(), "{bin}: {density}");
        }
        // The power of each degree l: the mean square of the spherical harmonics' sums, 1 for random points. Σ Y² = Σ P_l(cos) (2 l + 1) / 4π.
        let degrees = 24;
        let mut power = vec![0.0f64; degrees + 1];
        for a in &places {
            for b in &places {
                let x = a.dot(*b).clamp(-1.0, 1.0);
                let (mut last, mut now) = (1.0, x);
                for (l, power) in power.iter_mut().enumerate().skip(1) {
                    *power += now / count;
                    let l = l as f64;
                    (last, now) = (now, ((2.0 * l + 1.0) * x * now - l * last) / (l + 1.0));
                }
            }
        }
        // All 2 l + 1 harmonics count. Chance moves their mean by √(2/624) = 0.06 for random points.
        let weight: f64 = (1..=degrees).map(|l| 2.0 * l as f64 + 1.0).sum();
        let low: f64 = (1..=degrees).map(|l| power[l] * (2.0 * l as f64 + 1.0)).sum::<f64>() / weight;
        assert!(low < 0.3, "{low}: {power:?}");
        // Equal areas have equal numbers: χ² of random points would be about the number of the bins.
        let mut bins = [0.0f64; 96];
        for place in &places {
            let band = ((0.5 + 0.5 * place.y / place.length()) * 8.0).min(7.0) as usize;
            let turn = ((0.5 + place.x.atan2(place.z) / (2.0 * PI)) * 12.0).min(11.0) as usize;
            bins[12 * band + turn] += 1.0;
        }
        let square: f64 = bins.iter().map(|n| (n - count / 96.0).powi(2) / (count / 96.0)).sum();
        assert!(square < 0.6 * 95.0, "χ² {square} of 95 degrees of freedom");
    });
}

#[test]
fn areas_of_a_sphere_sum_to_its_surface() {
    with_gpu(|gpu| {
        let (_, samples) = points(gpu, &sphere(), 2000);
        let sum: f64 = samples.iter().map(|sample| f64::from(sample.area)).sum();
        // The facets are convex, between the sphere and one that is smaller by the cosine of half a facet's diagonal; so is their area. Each of 50
        // points of a sample counts, and those of the last one may be missing.
        let inner = (PI / (f64::from(RINGS) * 2f64.sqrt())).cos();
        let slack = 1e-3;
        let (low, high) = (4.0 * PI * (inner.powi(2) - slack), 4.0 * PI * (1.0 + slack));
        assert!(low <= sum && sum <= high, "{sum} is not in {low} to {high}");
        let mean = sum / samples.len() as f64;
        assert!(samples.iter().all(|s| f64::from(s.area) > 0.3 * mean && f64::from(s.area) < 3.0 * mean));
    });
}

#[test]
fn a_room_of_small_things_has_about_as_many_samples_as_were_asked_for() {
    with_gpu(|gpu| {
        // Boxes of some centimetres, near to each other: at the distance of the samples all of them are steps and gaps.
        let mut stage = Stage { scene: closed(Vec3::splat(0.5)) };
        for i in 0..150 {
            let low = Vec3::new(-0.8 + 0.11 * (i % 15) as f32, -0.999, -0.5 + 0.11 * (i / 15) as f32);
            stage.cuboid(0, low, low + Vec3::new(0.06, 0.05 + 0.01 * (i % 4) as f32, 0.06), false);
        }
        for asked in [600, 2400] {
            let (_, samples) = points(gpu, &stage.scene, asked);
            let more = samples.len() as f64 / f64::from(asked);
            assert!((more - 1.0).abs() < 0.15, "{} instead of {asked}", samples.len());
        }
    });
}

#[test]
fn samples_of_a_box_have_even_distances_and_faces_have_equal_numbers() {
    with_gpu(|gpu| {
        let (radius, samples) = points(gpu, &closed(Vec3::splat(0.5)), 3000);
        let mut counts = Vec::new();
        for normal in [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z] {
            let face: Vec<PrtPoint> =
                samples.iter().filter(|s| Vec3::from(s.side).dot(normal) > 0.9).copied().collect();
            let places: Vec<DVec3> = face.iter().map(at).collect();
            check_neighbours(&face, radius, radius);
            let area: f64 = face.iter().map(|sample| f64::from(sample.area)).sum();
            // 2 m × 2 m; points nearer to the samples of the next face count there: less than half a radius at four edges.
            assert!((area / 4.0 - 1.0).abs() < 0.02, "{area}");
            counts.push(places.len() as f64);
        }
        let mean = counts.iter().sum::<f64>() / 6.0;
        let square: f64 = counts.iter().map(|n| (n - mean).powi(2) / mean).sum();
        // 5 degrees of freedom: 4.35 is the median for random points.
        assert!(square < 4.35, "χ² {square}: {counts:?}");
    });
}
