//! Polygons of very many corners, and triangles that lie in each other: loaded, cut and put into trees in a time that grows with their
//! number, not with its square.

use std::{fmt::Write, time::Instant};

use glam::{Vec3, vec3};
use lucerna::scene::{
    self, Pose,
    bvh::{Bvh, Ray},
};

/// Seconds that none of this may take on a busy machine. The square of their number took minutes.
const BOUND: f64 = 30.0;

/// A closed line around the y axis, facing up, every other corner at `inner`.
fn polygon(count: usize, inner: f32) -> String {
    let mut text = String::new();
    for i in 0..count {
        let angle = -std::f32::consts::TAU * i as f32 / count as f32;
        let radius = if i % 2 == 0 { 1.0 } else { inner };
        writeln!(text, "v {:.7} 0 {:.7}", radius * angle.cos(), radius * angle.sin()).unwrap();
    }
    text + "f" + &(1..=count).map(|i| format!(" {i}")).collect::<String>() + "\n"
}

#[test]
fn polygons_of_many_corners_are_covered_once_and_soon() {
    let folder = tempfile::tempdir().unwrap();
    for (count, inner) in [(2_000, 1.0), (2_000, 0.6), (20_000, 1.0), (20_000, 0.6), (200_000, 1.0), (200_000, 0.6)] {
        let file = folder.path().join("polygon.obj");
        std::fs::write(&file, polygon(count, inner)).unwrap();
        let begun = Instant::now();
        let scene = scene::load(&file, &Default::default()).unwrap();
        let loaded = begun.elapsed().as_secs_f64();
        let bvh = Bvh::build(&scene, &Pose::rest(&scene));
        let seconds = begun.elapsed().as_secs_f64();
        println!("{count} corners, inner radius {inner}: {loaded:.2} s to load, {:.2} s for a tree", seconds - loaded);
        assert!(seconds < BOUND, "{count} corners: {seconds} s");
        assert_eq!(bvh.validate(), Ok(()));
        let area: f64 =
            bvh.triangles().iter().map(|[a, b, c]| f64::from((*b - *a).cross(*c - *a).length()) / 2.0).sum();
        let exact = f64::from(inner) * count as f64 * (std::f64::consts::TAU / count as f64).sin() / 2.0;
        assert!((area / exact - 1.0).abs() < 1e-3, "{count} corners: {area} instead of {exact}");
        // One surface over the middle, none beside it.
        let down = |x: f32| Ray::new(vec3(x, 1.0, 0.013), Vec3::NEG_Y);
        assert!(bvh.any(&down(0.3)) && bvh.any(&down(-0.5)) && !bvh.any(&down(1.1)));
    }
}

#[test]
fn trees_over_triangles_in_each_other_are_built_soon() {
    let count = 200_000;
    let at = |i: usize, size: f32| {
        let angle = std::f32::consts::TAU * i as f32 / count as f32;
        vec3(angle.cos(), angle.sin(), 0.0) * size
    };
    let fan: Vec<[Vec3; 3]> = (2..count).map(|i| [at(0, 1.0), at(i - 1, 1.0), at(i, 1.0)]).collect();
    let nested: Vec<[Vec3; 3]> =
        (1..count).map(|i| [0, count / 3, 2 * count / 3].map(|k| at(k, i as f32 / count as f32))).collect();
    let equal = vec![[Vec3::ZERO, Vec3::X, Vec3::Y]; count];
    let few: Vec<[Vec3; 3]> = fan.iter().copied().step_by(100).collect();
    for (name, triangles) in [("fan", fan), ("nested", nested), ("equal", equal), ("2000 of a fan", few)] {
        let begun = Instant::now();
        let bvh = Bvh::from_triangles(triangles);
        let seconds = begun.elapsed().as_secs_f64();
        println!("{name}: {seconds:.2} s");
        assert!(seconds < BOUND, "{name}: {seconds} s");
        assert_eq!(bvh.validate(), Ok(()), "{name}");
        // Most of that fan is left out.
        let hit = bvh.any(&Ray::new(vec3(0.05, 0.04, 1.0), Vec3::NEG_Z));
        assert!(hit || name == "2000 of a fan", "{name}");
    }
}
