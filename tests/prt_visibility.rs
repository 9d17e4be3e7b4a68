//! Stored distances against those to the sides of a box, and the penumbra of a disc against its closed form.

use std::f64::consts::PI;

use crate::{
    prt_lab::{baked, closed, diffuse, picture, sampled, small},
    tracer_lab::{Stage, flat_view},
};
use glam::{DVec3, Vec3, dvec3, vec3};
use lucerna::{
    gpu::testing::with_gpu,
    scene::{Material, Scene},
    techniques::prt::{Baking, Mode, Settings, Stored},
};

/// Distance from a point in the cube of 2 m around the origin to its surface.
fn to_cube(from: Vec3, way: Vec3) -> f64 {
    let (from, way) = (from.as_dvec3(), way.as_dvec3());
    (0..3).map(|axis| (way[axis].signum() - from[axis]) / way[axis]).fold(f64::INFINITY, f64::min)
}

/// The largest error of the distances of a bake of the cube, the root of their mean square, metres, and the share of errors that are larger than the
/// margin of the comparison with lights.
fn errors(stored: &Stored) -> [f64; 3] {
    let Settings { bias, bias_distance, .. } = Settings::default();
    let margin = |distance: f64| f64::from(bias) * distance + f64::from(bias_distance * stored.plan.radius);
    let far = f64::from(stored.plan.far);
    assert!((far - 12f64.sqrt()).abs() < 1e-6);
    let (mut most, mut square, mut over, mut count) = (0.0f64, 0.0, 0u64, 0u64);
    for (cluster, visibility) in stored.visibility.iter().enumerate() {
        let cap = stored.cap(cluster);
        for (row, sample) in stored.samples[stored.plan.range(cluster)].iter().enumerate() {
            let (at, side) = (Vec3::from(sample.position), Vec3::from(sample.side));
            for number in 0..cap.directions() {
                let way = cap.direction(number);
                // Below the horizon distances are unknown, and at the horizon they hang on the last bit.
                if way.dot(side) > 1e-3 {
                    let exact = to_cube(at, way);
                    let off = far * f64::from(visibility.distance(row, number)) - exact;
                    over += u64::from(off.abs() > margin(exact));
                    most = most.max(off.abs());
                    square += off * off;
                    count += 1;
                }
            }
        }
    }
    [most, (square / count as f64).sqrt(), over as f64 / count as f64]
}

#[test]
fn distances_in_a_box_are_those_to_its_sides() {
    with_gpu(|gpu| {
        let scene = closed(Vec3::splat(0.5));
        // As many vectors as there can be: only the rounding to 16 bits is left.
        let all = Baking { samples: 600, cluster: 60, directions: 196, visibility: 256, ..small() };
        let stored = baked(gpu, &scene, &all);
        let [most, root, over] = errors(&stored);
        // Half a unit of 11 bits is 0.85 mm for a mean between 1.7 m and 3.5 m; the products of all vectors add as much.
        assert!(most < 2e-3 && root < 3e-4 && over == 0.0, "{most} {root} {over}");
        // The default number of vectors, with the default numbers of directions and of samples in a cluster.
        let some = Baking { samples: 6000, examples: 16, rays: 16, ..Baking::default() };
        let stored = baked(gpu, &scene, &some);
        let [most, root, over] = errors(&stored);
        // At edges between sides few distances are far off, and they are no more than the bake states.
        assert!(root < 0.04 && (stored.summary().distance_error / root - 1.0).abs() < 0.03, "{root}");
        assert!(over < 0.012 && most < 2.0, "{most} {over}");
    });
}

#[test]
fn distances_that_no_single_buffer_holds_are_there() {
    with_gpu(|gpu| {
        let scene = closed(Vec3::splat(0.5));
        let (mut bakery, sampled) =
            sampled(gpu, &scene, &Baking { samples: 1300, cluster: 1300, directions: 16384, ..small() }).unwrap();
        let (plan, samples) = (&sampled.plan, &sampled.samples);
        bakery.upload(plan, samples).unwrap();
        let cluster = (0..plan.clusters.len()).max_by_key(|of| plan.clusters[*of]).unwrap();
        let cap = plan.cap(samples, cluster);
        let found = bakery.depths(plan, cluster, &cap).unwrap();
        let (range, directions) = (plan.range(cluster), cap.directions());
        assert_eq!(found.len(), range.len() * directions);
        assert!(4 * found.len() > 1 << 26, "{} {directions}: one buffer holds this", range.len());
        for (sample, row) in samples[range].iter().zip(found.chunks_exact(directions)) {
            let (at, side) = (Vec3::from(sample.position), Vec3::from(sample.side));
            for number in (0..directions).step_by(97) {
                let way = cap.direction(number);
                if way.dot(side) > 1e-3 {
                    assert!((f64::from(row[number]) - to_cube(at, way)).abs() < 1e-4, "{at} {way} {}", row[number]);
                }
            }
        }
    });
}

/// Heights of the lamp and of the disc above the floor, and their radii, metres.
const LAMP: [f64; 2] = [2.5, 0.3];
const DISC: [f64; 2] = [1.5, 0.5];

/// A room of 6×3×6 m with a disc between a lamp and the floor.
fn shaded() -> Scene {
    let mut stage = Stage::new();
    let wall = stage.material(Material::diffuse("wall", Vec3::splat(0.5)));
    stage.cuboid(wall, vec3(-3.0, 0.0, -3.0), vec3(3.0, 3.0, 3.0), true);
    let segments = 96;
    let y = DISC[0] as f32;
    let mut positions = vec![vec3(0.0, y, 0.0)];
    positions.extend((0..segments).map(|i| {
        let (sine, cosine) = (std::f32::consts::TAU * i as f32 / segments as f32).sin_cos();
        vec3(DISC[1] as f32 * cosine, y, DISC[1] as f32 * sine)
    }));
    for normal in [Vec3::Y, Vec3::NEG_Y] {
        // Two sheets, one a little lower.
        let places: Vec<Vec3> = positions.iter().map(|at| *at + 0.002 * normal).collect();
        let of = |i: u32| {
            let next = 1 + (i + 1) % segments;
            if normal == Vec3::Y { [0, next, 1 + i] } else { [0, 1 + i, next] }
        };
        stage.mesh(wall, places, vec![normal; positions.len()], (0..segments).flat_map(of).collect());
    }
    stage.point(vec3(0.0, LAMP[0] as f32, 0.0), Vec3::splat(5.0));
    stage.scene
}

/// Share of the light of a sphere, whose surface has even points, that the disc lets through to a point of the floor at this distance from the axis.
fn share(away: f64) -> f64 {
    let from = dvec3(away, 0.0, 0.0);
    let count = 20_000;
    let (mut open, mut lit) = (0.0, 0.0);
    for i in 0..count {
        let y = 1.0 - 2.0 * (f64::from(i) + 0.5) / f64::from(count);
        let (sine, cosine) = (f64::from(i) * PI * (3.0 - 5f64.sqrt())).sin_cos();
        let across = (1.0 - y * y).sqrt();
        let way = dvec3(0.0, LAMP[0], 0.0) + LAMP[1] * dvec3(across * cosine, y, across * sine) - from;
        let weight = way.y / way.length().powi(3);
        let at: DVec3 = from + way * (DISC[0] / way.y);
        open += weight;
        lit += if at.x.hypot(at.z) > DISC[1] { weight } else { 0.0 };
    }
    lit / open
}

#[test]
fn the_penumbra_of_a_disc_is_that_of_its_closed_form() {
    with_gpu(|gpu| {
        let scene = shaded();
        let stored = baked(
            gpu,
            &scene,
            &Baking { samples: 8000, cluster: 500, directions: 2016, visibility: 50, rays: 16, ..small() },
        );
        let mut settings = diffuse();
        settings.prt.radius = LAMP[1] as f32;
        settings.prt.points = 64;
        let width = 120usize;
        let eye = flat_view(vec3(0.0, 1.4, 0.0), Vec3::ZERO, 6.0, [width as u32; 2]);
        let found = picture(gpu, &scene, &stored, &eye, &settings, Mode::Shadow);
        let layer = found.layer("shadow").unwrap();
        let metres = |i: usize| (i as f64 + 0.5) * 6.0 / width as f64 - 3.0;
        let pixels = |y: usize| {
            (0..width).map(move |x| (metres(x).hypot(metres(y)), layer.data[layer.channels.len() * (y * width + x)]))
        };
        // A shadow is as sharp as the samples are close, and as the directions are narrow: an edge of the disc lies anywhere in a cell of
        // (2 π / 2016)^½ = 3.2°.
        let cell = (2.0 * PI / 2016.0).sqrt();
        let slack = |away: f64| f64::from(stored.plan.radius).max(cell * DISC[0].hypot(away - DISC[1]));
        let outside = |away: f64, found: f64, width: f64, more: f64| {
            let [low, high] = [-1.0, 1.0].map(|side| share((away + side * width).max(0.0)));
            found - (high + more) > 0.0 || found - (low - more) < 0.0
        };
        // Mean over rings: two or three of 64 points of the lamp more or less.
        for ring in 0..28 {
            let away = 0.1 * f64::from(ring) + 0.05;
            let ring: Vec<f32> = (0..width)
                .flat_map(pixels)
                .filter(|(at, _)| (at - away).abs() < 0.05)
                .map(|(_, share)| share)
                .collect();
            let mean = f64::from(ring.iter().sum::<f32>()) / ring.len() as f64;
            assert!(!outside(away, mean, slack(away), 2.5 / 64.0), "{away}: {mean} instead of {}", share(away));
        }
        // Each pixel of lines over the shadow: samples are one by one off by a cell and a distance of samples.
        for y in [width / 2, width / 2 + 5, width / 2 - 8] {
            for (away, found) in pixels(y) {
                let off = outside(away, found.into(), 2.0 * slack(away), 0.1);
                assert!(!off, "{y} {away}: {found} instead of {}", share(away));
            }
        }
        // The shadow is there, and it ends.
        assert!(share(0.5) == 0.0 && share(1.25) > 0.4 && share(1.25) < 0.7 && share(2.0) == 1.0);
    });
}
