//! The look-up of baked daylight on the device: faces of a cube and patches of the sky agree with their twins.

use glam::{IVec2, Vec2, Vec3};
use lucerna::{
    gpu::testing::with_gpu,
    graph::{Graph, Runner},
    shaders,
    techniques::daylight::{cube, patch::patch_of},
};

#[test]
fn faces_texels_and_patches_are_those_of_the_processor() {
    let side = 24;
    let steps = [[-1, 0], [24, 5], [3, -1], [23, 24], [7, 9], [-1, 24], [24, 23], [0, -1]];
    let queries: Vec<(Vec3, [i32; 2])> = (0..4096)
        .map(|i| {
            let t = i as f32;
            let direction = Vec3::new((t * 0.713).sin(), (t * 1.317).sin(), (t * 2.111).cos()) * (0.1 + t);
            (direction, steps[i % steps.len()])
        })
        .collect();
    let contents: Vec<_> = queries
        .iter()
        .map(|(direction, step)| shaders::types::DayLookup {
            direction: direction.to_array(),
            step: *step,
            ..Default::default()
        })
        .collect();
    with_gpu(|gpu| {
        let mut graph = Graph::new("lookup");
        let lookups = graph.buffer_from("lookups", &contents);
        let push = shaders::test::day_lookup::Push { count: queries.len() as u32, side };
        graph.compute(shaders::test::day_lookup::Args { lookups, push }, queries.len() as u32);
        let read = graph.read_buffer(lookups);
        let found: Vec<shaders::types::DayLookup> = Runner::new(gpu).run(&graph).unwrap().buffer(read);
        let mut beside = 0;
        for (found, (direction, step)) in found.iter().zip(&queries) {
            let (face, place) = cube::face(*direction);
            assert_eq!(found.face as usize, face, "{direction}");
            assert!(Vec2::from(found.place).distance(place) < 1e-5, "{direction}: {:?} {place}", found.place);
            let texel = cube::texel(face, *step, side);
            assert_eq!(found.there != 0, texel.is_some(), "{step:?}");
            if let Some(texel) = texel {
                assert_eq!(found.texel, texel, "{face} {}", IVec2::from(*step));
                beside += u32::from(texel[2] as usize != face);
            }
            // At a border of two patches rounding decides.
            let near = |by: Vec3| patch_of((direction.normalize() + 1e-5 * by).to_array());
            let patches = [Vec3::ZERO, Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z].map(near);
            assert!(patches.contains(&(found.sky_patch as usize)), "{direction}: {}", found.sky_patch);
        }
        assert!(beside > 1000, "{beside}");
    });
}
