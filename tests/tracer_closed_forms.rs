//! Pictures of the path tracer where the light is known exactly.

mod tracer_lab;

use glam::{Vec3, vec3};
use lucerna::{gpu::testing::with_gpu, scene::Material};
use tracer_lab::{Stage, expect_mean, matt, mean, render, view};

/// A box of two metres whose walls emit `e` and reflect `rho`.
fn closed_box(e: f32, rho: f32) -> Stage {
    let mut stage = Stage::new();
    let wall = stage.material(Material { emissive: Vec3::splat(e), ..Material::diffuse("wall", Vec3::splat(rho)) });
    stage.cuboid(wall, Vec3::splat(-1.0), Vec3::splat(1.0), true);
    stage
}

#[test]
fn a_closed_box_is_a_geometric_series() {
    with_gpu(|gpu| {
        let stage = closed_box(0.3, 0.5);
        let seen = view(vec3(0.3, 0.2, 0.4), vec3(-1.0, -0.6, -0.9), 70.0, [16, 16]);
        // Through the pixel's centre the wall shows its emission exactly: 0.3; each scattering adds ρ times as much.
        for (bounces, samples) in [(0, 32), (1, 32), (3, 32), (40, 48)] {
            let layers = render(gpu, &stage.scene, &seen, &matt(bounces), samples);
            let exact = 0.3 * (1.0 - 0.5f64.powi(bounces as i32 + 2)) / 0.5;
            expect_mean(&layers, exact, 1e-5);
            assert!((mean(&layers, "emission")[0] - 0.3).abs() < 1e-6);
            assert!((mean(&layers, "direct")[1] - 0.15).abs() < 0.003, "{:?}", mean(&layers, "direct"));
        }
    });
}
