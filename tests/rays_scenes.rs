//! Rays through whole scenes on the device against the hierarchy of the CPU.

mod rays_kit;

use lucerna::{
    gpu::testing::with_gpu,
    scene::{AlphaMode, Pose, Scene, builtin, bvh::Bvh},
};
use rays_kit::*;

/// Compares closest and any hits of random rays, and says how many hit something.
fn compare(traceable: &mut Traceable<'_>, pose: &Pose, count: usize, seed: u64) -> usize {
    let scene: &Scene = traceable.scene;
    let bvh = Bvh::build(scene, pose);
    let ids = device_ids(scene, &bvh);
    let (low, high) = bvh.bounds().unwrap();
    let size = (high - low).max_element();
    let rays = random_rays(&mut Numbers(seed), count, low, high);
    let traced = traceable.trace(pose, &rays, 0, 0);
    let mut hits = 0;
    for (i, ray) in rays.iter().enumerate() {
        let (found, expected) = (traced.closest[i], bvh.closest(&cpu(ray)));
        let what = format!("{}, ray {i} {ray:?}: {found:?}, CPU {expected:?}", scene.name);
        assert_eq!(traced.any[i], found.instance != u32::MAX, "{what}");
        let Some(expected) = expected else {
            assert_eq!(found.instance, u32::MAX, "{what}");
            continue;
        };
        hits += 1;
        // Same place; and the same triangle, unless another is hit there as well.
        let length = glam::Vec3::from(ray.direction).length();
        assert!((found.t - expected.t).abs() * length <= 2e-5 * size, "{what}");
        if (found.instance, found.triangle) != ids[expected.triangle as usize] {
            let mut there = false;
            let near = lucerna::scene::bvh::Ray { t_max: expected.t + 1e-4 * size / length, ..cpu(ray) };
            bvh.walk(&near, |hit| {
                there |= ids[hit.triangle as usize] == (found.instance, found.triangle);
                lucerna::scene::bvh::Step::Ignore
            });
            assert!(there, "{what}");
        }
    }
    hits
}

#[test]
fn built_in_scenes_are_hit_where_the_cpu_hits_them() {
    let mut tested = 0;
    with_gpu(|gpu| {
        for name in builtin::NAMES.iter().copied() {
            let scene = builtin::load(name).unwrap();
            if scene.materials.iter().any(|m| !matches!(m.alpha, AlphaMode::Opaque)) || !scene.skins.is_empty() {
                continue;
            }
            let hits = compare(&mut Traceable::new(gpu, &scene), &Pose::rest(&scene), 2000, 7);
            assert!(hits > 200, "{name}: {hits}");
            tested += 1;
        }
        assert!(tested >= 6, "{tested}");
    });
}
