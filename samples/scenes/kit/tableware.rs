//! Vessels, cups and bowls for tables.

use super::{Geometry, Model, circle, lathe, profile, sphere, srgb, sweep};
use glam::{Vec3, vec2, vec3};

/// A vessel: up its outside and down its inside.
pub(crate) fn vessel(outside: &[(f32, f32)], inside: &[(f32, f32)], steps: usize, segments: usize) -> Geometry {
    let mut way = profile(outside, steps);
    way.extend(profile(inside, steps));
    lathe(&way, segments, 50.0)
}

/// A bowl of fruit, each round in `segments`; the fruit's colours are those of its vertices.
pub(crate) fn fruit_bowl(porcelain: u32, fruit: u32, segments: usize) -> Model {
    let outside = [(0.0, 0.0), (0.07, 0.0), (0.075, 0.012), (0.13, 0.05), (0.175, 0.095)];
    let inside = [(0.172, 0.097), (0.126, 0.056), (0.07, 0.022), (0.0, 0.018)];
    let mut model = Model::of(porcelain, vessel(&outside, &inside, 3, segments * 11 / 6));
    let kinds = [0xc4342b, 0xe0912a, 0x9fb83a, 0xd9b23a];
    for i in 0..9 {
        let (ring, turn) = if i < 6 { (0.092, 60.0 * i as f32) } else { (0.045, 120.0 * (i - 6) as f32 + 30.0) };
        let radius = 0.038 + 0.002 * (i % 3) as f32;
        let height = if i < 6 { 0.092 } else { 0.145 };
        // A dent at the stalk.
        let dented =
            |p: Vec3| p - Vec3::Y * (0.35 * radius * (-(p.x * p.x + p.z * p.z) / (0.09 * radius * radius)).exp());
        let one = sphere(radius, segments, segments / 2).displaced(|p| if p.y > 0.0 { dented(p) } else { p });
        let tilted = one.turned_x(17.0 * i as f32).at(ring, height, 0.0).turned_y(turn);
        model.add(fruit, tilted.colored(srgb(kinds[i % kinds.len()])));
    }
    model
}

/// A cup on its saucer, round in `segments`, the handle towards +X.
pub(crate) fn cup(porcelain: u32, segments: usize) -> Model {
    let saucer =
        [(0.0, 0.0), (0.03, 0.0), (0.034, 0.004), (0.058, 0.011), (0.0575, 0.0125), (0.03, 0.0075), (0.0, 0.0075)];
    let mut out = lathe(&saucer.map(|(r, y)| vec2(r, y)), segments, 40.0);
    let outside = [(0.0, 0.0), (0.02, 0.0), (0.024, 0.005), (0.036, 0.03), (0.039, 0.055)];
    let inside = [(0.0372, 0.0552), (0.034, 0.03), (0.022, 0.008), (0.0, 0.0055)];
    out.append(&vessel(&outside, &inside, 2, segments).at(0.0, 0.0078, 0.0));
    let grip: Vec<Vec3> = (0..=8)
        .map(|i| {
            let angle = (-70.0 + 140.0 * i as f32 / 8.0f32).to_radians();
            vec3(0.031 + 0.021 * angle.cos(), 0.04 + 0.017 * angle.sin(), 0.0)
        })
        .collect();
    out.append(&sweep(&grip, &circle(0.0033, 6), true, |_| 1.0));
    Model::of(porcelain, out)
}
