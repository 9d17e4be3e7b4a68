//! Rays through whole scenes on the device against the hierarchy of the CPU.

use crate::common;
use crate::rays_kit::*;
use glam::{Mat4, Quat, Vec3};
use lucerna::{
    gpu::testing::with_gpu,
    scene::{
        AlphaMode, LoadOptions, Pose, Scene,
        bvh::{self, Bvh},
        load,
    },
};
use lucerna_scenes as builtin;

/// Compares closest and any hits of random rays, and says how many hit something.
fn compare(traceable: &mut Traceable<'_>, pose: &Pose, count: usize, seed: u64) -> usize {
    let scene: &Scene = traceable.scene;
    let bvh = Bvh::build(scene, pose);
    let ids = device_ids(scene, &bvh);
    let (low, high) = bvh.bounds().unwrap();
    let size = (high - low).max_element();
    let rays = random_rays(&mut Numbers(seed), count, low, high);
    let traced = traceable.trace(pose, &rays, 0, 0);
    let (mut hits, mut undecided) = (0, 0);
    for (i, ray) in rays.iter().enumerate() {
        let (found, expected) = (traced.closest[i], bvh.closest(&cpu(ray)));
        let what = format!("{}, ray {i} {ray:?}: {found:?}, CPU {expected:?}", scene.name);
        assert_eq!(traced.any[i], found.instance != u32::MAX, "{what}");
        let length = Vec3::from(ray.direction).length();
        let t = expected.map_or(f32::MAX, |h| h.t);
        if found.instance == u32::MAX && expected.is_none() {
            continue;
        }
        if (found.t - t).abs() * length > 2e-5 * size {
            // Vertices are rounded differently on the two: a ray along an edge may go either way.
            let mut numbers = Numbers(9);
            let near = (0..16).any(|_| {
                let origin = cpu(ray).origin + numbers.vector() * 2e-5 * size;
                bvh.closest(&bvh::Ray { origin, ..cpu(ray) }).map_or(f32::MAX, |h| h.t) - t != 0.0
                    && (bvh.closest(&bvh::Ray { origin, ..cpu(ray) }).map_or(f32::MAX, |h| h.t) - found.t).abs()
                        * length
                        <= 1e-4 * size
            });
            assert!(near, "{what}");
            undecided += 1;
            continue;
        }
        hits += 1;
        // The same triangle, unless another is hit there as well.
        if expected.is_none_or(|e| (found.instance, found.triangle) != ids[e.triangle as usize]) {
            let mut there = false;
            let near = bvh::Ray { t_max: t + 1e-4 * size / length, ..cpu(ray) };
            bvh.walk(&near, |hit| {
                there |= ids[hit.triangle as usize] == (found.instance, found.triangle);
                bvh::Step::Ignore
            });
            undecided += usize::from(!there);
        }
    }
    assert!(undecided * 500 <= count, "{}: {undecided} rays may go either way", scene.name);
    hits
}

#[test]
fn built_in_scenes_are_hit_where_the_cpu_hits_them() {
    let mut tested = 0;
    with_gpu(|gpu| {
        for name in builtin::NAMES.iter().copied() {
            let scene = builtin::load(name).unwrap();
            if scene.materials.iter().any(|m| !matches!(m.alpha, AlphaMode::Opaque)) {
                continue;
            }
            let hits = compare(&mut Traceable::new(gpu, &scene), &Pose::rest(&scene), 2000, 7);
            assert!(hits > 200, "{name}: {hits}");
            tested += 1;
        }
        assert!(tested >= 6, "{tested}");
    });
}

/// Poses of a scene at several times of all its animations.
fn at_several_times(traceable: &mut Traceable<'_>, count: usize) {
    let mut poses = vec![];
    for seconds in [0.0, 0.3, 0.77, 1.4] {
        let pose = Pose::playing(traceable.scene, seconds);
        let hits = compare(traceable, &pose, count, 3);
        assert!(hits > count / 100, "{}: {hits}", traceable.scene.name);
        poses.push(pose);
    }
    assert!(poses.iter().any(|p| *p != poses[0]), "{} must move", traceable.scene.name);
}

#[test]
fn an_animated_figure_is_hit_as_a_fresh_tree_would_be() {
    with_gpu(|gpu| {
        let scene = builtin::load("figure").unwrap();
        assert!(!scene.skins.is_empty());
        at_several_times(&mut Traceable::new(gpu, &scene), 1000);
    });
}

#[test]
fn animated_models_are_hit_as_fresh_trees_would_be() {
    let Some(assets) = common::assets() else { return };
    with_gpu(|gpu| {
        for name in ["CesiumMan", "AnimatedMorphCube", "BoxAnimated", "Fox"] {
            let folder = assets.join("gltf").join(name);
            let files = std::fs::read_dir(folder).unwrap().map(|f| f.unwrap().path());
            let file = files.into_iter().find(|f| f.extension().is_some_and(|e| e == "gltf" || e == "glb")).unwrap();
            let scene = load(&file, &LoadOptions::default()).unwrap();
            at_several_times(&mut Traceable::new(gpu, &scene), 1000);
        }
    });
}

#[test]
fn what_was_still_when_the_trees_were_built_may_be_moved() {
    with_gpu(|gpu| {
        let scene = builtin::load("primitives").unwrap();
        assert!(scene.animations.is_empty());
        let mut traceable = Traceable::new(gpu, &scene);
        let rest = Pose::rest(&scene);
        let mut moved = rest.clone();
        for (node, world) in moved.world.iter_mut().enumerate().filter(|(n, _)| scene.nodes[*n].mesh.is_some()) {
            // Turned, scaled, and every other one mirrored.
            let turn = Quat::from_rotation_y(node as f32);
            let scale = Vec3::new(1.3, 0.7, if node % 2 == 0 { 1.1 } else { -1.1 });
            *world *= Mat4::from_scale_rotation_translation(scale, turn, Vec3::new(0.1, 0.3, -0.2));
        }
        for pose in [&rest, &moved, &rest] {
            assert!(compare(&mut traceable, pose, 2000, 5) > 200);
        }
    });
}
