//! The bound by which tiles of pixels leave occluders out holds for each pixel of the tile.

use glam::{Quat, vec3};
use lucerna::{
    gpu::testing::with_gpu,
    graph::{Graph, Runner},
    shaders::{
        consts::{FIV_MATTER_AZIMUTHS, FIV_MATTER_LEVELS, FIV_MATTER_POLARS},
        test::fiv_matter,
        types::MatterQuery,
    },
};

/// Uniform numbers in 0..1 from a hash.
fn random(seed: &mut u64) -> f32 {
    *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*seed >> 40) as f32 / (1 << 24) as f32
}

#[test]
fn the_bound_of_a_tile_holds_for_every_direction_and_radius_in_it() {
    with_gpu(|gpu| {
        // Neighbours differ as much as they can; larger discs contain the light of smaller ones.
        let mut seed = 1;
        let cells = (FIV_MATTER_AZIMUTHS * FIV_MATTER_POLARS) as usize;
        let mut table: Vec<f32> = (0..cells).map(|_| random(&mut seed).powi(4)).collect();
        for level in 1..FIV_MATTER_LEVELS as usize {
            for cell in 0..cells {
                table.push(table[(level - 1) * cells + cell] + 0.1 * random(&mut seed).powi(8));
            }
        }
        let mut queries = Vec::new();
        for number in 0..20_000u32 {
            let polar = match number % 4 {
                // Near the poles, where a step of azimuth is short.
                0 => 0.3 * random(&mut seed).powi(2),
                1 => std::f32::consts::PI - 0.3 * random(&mut seed).powi(2),
                _ => (1.0 - 2.0 * random(&mut seed)).acos(),
            };
            let azimuth = std::f32::consts::TAU * random(&mut seed);
            let around = vec3(polar.sin() * azimuth.sin(), polar.cos(), -polar.sin() * azimuth.cos());
            let off = 0.15 * random(&mut seed).powi(2);
            // A direction whose chord to `around` is at most `off`.
            let angle = 2.0 * (0.5 * off * 0.999).asin() * random(&mut seed).sqrt();
            let turn = Quat::from_axis_angle(around, std::f32::consts::TAU * random(&mut seed));
            let direction = Quat::from_axis_angle(turn * around.any_orthonormal_vector(), angle) * around;
            let most = random(&mut seed).max(0.01);
            let radius = if number % 3 == 0 { most } else { most * random(&mut seed) };
            let (around, direction) = (around.to_array(), direction.normalize().to_array());
            queries.push(MatterQuery { around, off, most, direction, radius });
        }
        let mut graph = Graph::new("matter");
        let bounds = graph.buffer("bounds", 8 * queries.len() as u64);
        let args = fiv_matter::Args {
            matter: graph.buffer_from("matter", &table),
            queries: graph.buffer_from("queries", &queries),
            bounds,
        };
        graph.compute(args, queries.len() as u32);
        let read = graph.read_buffer(bounds);
        let found: Vec<[f32; 2]> = Runner::new(gpu).run(&graph).unwrap().buffer(read);
        let mut bounded = 0;
        for (query, [one, all]) in queries.iter().zip(&found) {
            assert!(one.is_finite() && *one >= 0.0 && *one <= all * (1.0 + 1e-5), "{one} above {all}: {query:?}");
            bounded += usize::from(*all < 1e20);
        }
        // Only around the poles there is no bound.
        assert!(bounded > 5_000 && bounded < queries.len(), "{bounded} of {}", queries.len());
        assert!(
            found
                .iter()
                .zip(&queries)
                .all(|([_, all], q)| *all < 1e20 || q.around[0].hypot(q.around[2]) < 1.2 * 14.0 * q.off)
        );
    });
}
