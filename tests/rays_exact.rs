//! The compute traversal against brute force with the same arithmetic, on triangles and rays that break careless ones.

use crate::rays_kit::*;
use crate::scene_kit::mesh;
use glam::{EulerRot, Mat4, Quat, Vec3};
use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    scene::{Animation, Channel, Interpolation, Keys, Material, Node, Pose, Primitive, Scene, Transform},
    shaders::types,
};

/// One mesh of these triangles, double-sided.
fn scene_of(triangles: &[[Vec3; 3]]) -> Scene {
    let mut scene = Scene::default();
    let positions: Vec<Vec3> = triangles.iter().flatten().copied().collect();
    let primitive = Primitive {
        normals: vec![Vec3::Y; positions.len()],
        tangents: vec![glam::Vec4::ZERO; positions.len()],
        indices: (0..positions.len() as u32).collect(),
        positions,
        ..Primitive::default()
    };
    let index = mesh(&mut scene, primitive, Material { double_sided: true, ..Material::diffuse("", Vec3::ONE) });
    scene.nodes.push(Node { mesh: Some(index), ..Node::default() });
    scene
}

/// `trace_triangle` of lib/trace_common.glsl, operation by operation: t and the weights of the second and third vertex.
fn intersect(ray: &types::Ray, triangle: &[Vec3; 3]) -> Option<[f32; 3]> {
    let (origin, d) = (Vec3::from(ray.origin), Vec3::from(ray.direction));
    let size = d.abs();
    let axis = if size.x > size.y && size.x > size.z { 0 } else { 2 - usize::from(size.y > size.z) };
    let turned = |v: Vec3| {
        let (x, y) = (v[(axis + 1) % 3], v[(axis + 2) % 3]);
        if d[axis] < 0.0 { Vec3::new(y, x, v[axis]) } else { Vec3::new(x, y, v[axis]) }
    };
    let s = turned(d);
    let scale = Vec3::new(s.x / s.z, s.y / s.z, 1.0 / s.z);
    let corner = |p: Vec3| {
        let q = turned(p - origin);
        Vec3::new(q.x - scale.x * q.z, q.y - scale.y * q.z, scale.z * q.z)
    };
    let [p, q, r] = triangle.map(corner);
    let (u, v, w) = (r.x * q.y - r.y * q.x, p.x * r.y - p.y * r.x, q.x * p.y - q.y * p.x);
    let determinant = u + v + w;
    if (u.min(v.min(w)) < 0.0 && u.max(v.max(w)) > 0.0) || determinant == 0.0 {
        return None;
    }
    let z = u * p.z + v * q.z + w * r.z;
    let t = z / determinant;
    (t >= ray.t_min && t < ray.t_max).then_some([t, v / determinant, w / determinant])
}

/// Of equal hits the first triangle's.
fn brute_force(ray: &types::Ray, triangles: &[[Vec3; 3]]) -> Option<([f32; 3], u32)> {
    let hits = triangles.iter().enumerate().filter_map(|(i, t)| Some((intersect(ray, t)?, i as u32)));
    hits.min_by(|a, b| a.0[0].total_cmp(&b.0[0]))
}

/// CPU drivers do the arithmetic of IEEE 754; graphics processors may divide less exactly.
fn is_exact(gpu: &Gpu) -> bool {
    gpu.describe().device.contains("llvmpipe")
}

/// Share of a triangle beside its edges in which rounding decides whether it is hit.
const EDGE: f32 = 1e-4;

/// Whether a hit with these weights of the second and third corner lies clear of the edges. Slivers have hits beside edges alone.
fn is_clear(barycentrics: [f32; 2]) -> bool {
    let [v, w] = barycentrics;
    v.min(w).min(1.0 - v - w) > EDGE
}

fn check(gpu: &Gpu, what: &str, triangles: &[[Vec3; 3]], rays: &[types::Ray]) -> usize {
    let scene = scene_of(triangles);
    let traced = Traceable::new(gpu, &scene).trace(&Pose::rest(&scene), rays, 0, 0);
    let mut hits = 0;
    for (i, ray) in rays.iter().enumerate() {
        let (found, expected) = (traced.closest[i], brute_force(ray, triangles));
        let text = format!("{what}, ray {i} {ray:?}: {found:?}, expected {expected:?}");
        assert_eq!(traced.any[i], found.instance != u32::MAX, "{text}");
        // Coordinates are rounded, and with them places along the ray.
        let size = Vec3::from(ray.origin).abs().max_element() / Vec3::from(ray.direction).length();
        match expected {
            Some((at, triangle)) if is_exact(gpu) => {
                assert_eq!((found.t, found.barycentrics, found.triangle), (at[0], [at[1], at[2]], triangle), "{text}");
            }
            Some((at, _)) if is_clear([at[1], at[2]]) => {
                // Something nearer may be hit beside an edge.
                let near = (found.t - at[0]).abs() <= 1e-4 * at[0].abs() + 1e-5 * size;
                assert!(near || (found.t < at[0] && !is_clear(found.barycentrics)), "{text}");
            }
            Some(_) => {}
            None if is_exact(gpu) => assert_eq!(found.instance, u32::MAX, "{text}"),
            None => assert!(found.instance == u32::MAX || !is_clear(found.barycentrics), "{text}"),
        }
        hits += usize::from(expected.is_some());
    }
    hits
}

/// Degenerate to a point and to a line, in planes of two coordinates, copies, slivers, and ordinary ones.
fn awkward(numbers: &mut Numbers, count: usize, scale: f32) -> Vec<[Vec3; 3]> {
    let mut triangles: Vec<[Vec3; 3]> = Vec::new();
    for i in 0..count {
        let centre = numbers.vector() * 4.0 * scale;
        triangles.push(match i % 8 {
            0 => [centre; 3],
            1 => [centre, centre + Vec3::X * scale, centre + Vec3::X * 2.0 * scale],
            2 => [centre.with_y(0.0), (centre + Vec3::X * scale).with_y(0.0), (centre + Vec3::Z * scale).with_y(0.0)],
            3 => triangles[i - 1],
            4 => [centre, centre + numbers.vector() * 5.0 * scale, centre + numbers.vector() * 1e-5 * scale],
            _ => [centre, centre + numbers.vector() * scale, centre + numbers.vector() * scale],
        });
    }
    triangles
}

fn awkward_rays(numbers: &mut Numbers, count: usize, triangles: &[[Vec3; 3]], scale: f32) -> Vec<types::Ray> {
    let axes = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
    let rays = (0..count).map(|i| {
        let origin = numbers.vector() * 5.0 * scale;
        let [a, b, c] = triangles[(i * 7) % triangles.len()];
        match i % 6 {
            0 => ray(origin, axes[i / 6 % 6]),
            // In the plane of the flat ones; one component zero.
            1 => ray(origin.with_y(0.0), numbers.vector().with_y(0.0) + Vec3::X * 1e-3),
            2 => ray(origin, numbers.vector().with_z(-0.0) + Vec3::Y * 1e-3),
            // At a corner, and from a corner along the plane of its triangle.
            3 => ray(origin, a - origin),
            4 if b != a => ray(a, (b - a) + (c - a) * 0.5),
            _ => ray(origin, numbers.vector() + Vec3::splat(1e-6)),
        }
    });
    rays.filter(|r| r.direction != [0.0; 3]).collect()
}

#[test]
fn awkward_triangles_are_hit_as_by_brute_force() {
    with_gpu(|gpu| {
        let mut numbers = Numbers(11);
        for count in [1, 2, 7, 8, 9, 40, 300] {
            let triangles = awkward(&mut numbers, count, 1.0);
            let rays = awkward_rays(&mut numbers, 1500, &triangles, 1.0);
            let hits = check(gpu, &format!("{count} triangles"), &triangles, &rays);
            assert!(count < 40 || hits > 100, "{count}: {hits}");
        }
    });
}

#[test]
fn huge_and_tiny_scenes_are_hit_as_by_brute_force() {
    with_gpu(|gpu| {
        let mut numbers = Numbers(5);
        for scale in [1e-12f32, 1e-6, 1e-3, 1e3, 1e6, 1e12] {
            // Products of three such lengths are near the smallest normal number, and GPUs take what is below it for 0.
            if scale == 1e-12 && !is_exact(gpu) {
                continue;
            }
            let triangles = awkward(&mut numbers, 60, scale);
            let mut rays = awkward_rays(&mut numbers, 600, &triangles, scale);
            // Directions of any length.
            for (i, ray) in rays.iter_mut().enumerate() {
                let longer = [1.0, 1e-6, 1e6][i % 3];
                ray.direction = (Vec3::from(ray.direction) * longer).to_array();
            }
            assert!(check(gpu, &format!("scale {scale}"), &triangles, &rays) > 50);
        }
        // Small things far out, and large ones among small ones.
        let mut triangles = awkward(&mut numbers, 100, 1e-3);
        triangles.iter_mut().flatten().for_each(|p| *p += Vec3::new(900.0, -400.0, 100.0));
        triangles.extend(awkward(&mut numbers, 20, 1e4));
        let rays: Vec<_> = (0..600)
            .map(|i| {
                let origin = Vec3::new(900.0, -400.0, 100.0) + numbers.vector() * 0.01;
                ray(origin, triangles[i % 100][0] - origin + numbers.vector() * 1e-4)
            })
            .collect();
        check(gpu, "far out", &triangles, &rays);
    });
}

#[test]
fn segments_end_exactly_where_they_say() {
    with_gpu(|gpu| {
        let mut numbers = Numbers(3);
        let triangles: Vec<[Vec3; 3]> = (0..20).map(|_| [0; 3].map(|_| numbers.vector())).collect();
        let scene = scene_of(&triangles);
        let mut traceable = Traceable::new(gpu, &scene);
        let pose = Pose::rest(&scene);
        let rays = random_rays(&mut numbers, 400, -Vec3::ONE, Vec3::ONE);
        let first = traceable.trace(&pose, &rays, 0, 0).closest;
        let hit: Vec<_> = rays.into_iter().zip(&first).filter(|(_, h)| h.instance != u32::MAX && h.t > 0.0).collect();
        assert!(hit.len() > 20);
        let segments: Vec<_> = hit
            .iter()
            .flat_map(|(ray, hit)| {
                let ends = [(hit.t, f32::MAX), (hit.t.next_up(), f32::MAX), (0.0, hit.t), (0.0, hit.t.next_up())];
                ends.map(|(t_min, t_max)| types::Ray { t_min, t_max, ..*ray })
            })
            .collect();
        let found = traceable.trace(&pose, &segments, 0, 0);
        for (i, (_, hit)) in hit.iter().enumerate() {
            let is_it =
                |k: usize| (found.closest[4 * i + k].t, found.closest[4 * i + k].triangle) == (hit.t, hit.triangle);
            let any = &found.any[4 * i..4 * i + 4];
            assert!(is_it(0) && any[0], "t_min counts");
            assert!(!is_it(1), "what lies before t_min does not count");
            assert!(!is_it(2) && !any[2], "t_max does not count");
            assert!(is_it(3) && any[3], "what lies before t_max counts");
        }
    });
}

/// A closed bumpy body of `6 · n² · 2` triangles around the origin, wound counter-clockwise, whose neighbours share corners
/// bit by bit.
fn body(n: i32) -> Vec<[Vec3; 3]> {
    let mut triangles = Vec::new();
    for axis in 0..3 {
        for side in [-1.0f32, 1.0] {
            let at = |i: i32, j: i32| {
                let mut p = [0.0; 3];
                (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) =
                    (side, 2.0 * i as f32 / n as f32 - 1.0, 2.0 * j as f32 / n as f32 - 1.0);
                let p = Vec3::from(p);
                let bump = 1.0 + 0.03 * (3.0 * p.x).sin() * (5.0 * p.y).cos() + 0.02 * (6.0 * p.z).sin();
                p.normalize() * bump
            };
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                let both = if side > 0.0 { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] };
                triangles.extend(both);
            }
        }
    }
    triangles
}

#[test]
fn no_ray_slips_out_of_a_closed_body() {
    with_gpu(|gpu| {
        let triangles = body(10);
        let mut numbers = Numbers(8);
        let turn = Quat::from_euler(EulerRot::XYZ, 0.4, 1.1, -0.3);
        let places = [
            Mat4::IDENTITY,
            Mat4::from_scale_rotation_translation(Vec3::new(0.3, 2.0, 7.0), turn, Vec3::new(30.0, -4.0, 9.0)),
        ];
        for (place, moves) in [(places[0], false), (places[1], false), (places[1], true)] {
            let mut scene = scene_of(&triangles);
            let (scale, rotation, translation) = place.to_scale_rotation_translation();
            scene.nodes[0].local = Transform::Trs { translation, rotation, scale };
            if moves {
                let values = Keys::Translation(vec![translation]);
                let channel = Channel { node: 0, interpolation: Interpolation::Linear, times: vec![0.0], values };
                scene.animations = vec![Animation { name: String::new(), channels: vec![channel] }];
            }
            let mut rays = Vec::new();
            for [a, b, c] in &triangles {
                for target in [*a, (*a + *b) * 0.5, *a + (*b - *a) * 0.3, (*a + *c) * 0.5, (*a + *b + *c) / 3.0] {
                    let origin = place.transform_point3(numbers.vector() * 0.2);
                    rays.push(ray(origin, place.transform_point3(target) - origin));
                }
            }
            let traced = Traceable::new(gpu, &scene).trace(&Pose::rest(&scene), &rays, 0, 0);
            for (ray, (hit, any)) in rays.iter().zip(traced.closest.iter().zip(&traced.any)) {
                assert!(hit.instance != u32::MAX && *any, "{ray:?} slipped out, moves: {moves}");
            }
            // From inside all faces are seen from behind.
            let single = scene.materials[0].double_sided;
            assert!(single);
            scene.materials[0].double_sided = false;
            let mut traceable = Traceable::new(gpu, &scene);
            let culled = traceable.trace(&Pose::rest(&scene), &rays[..500], 1, 0);
            let seen = culled.closest.iter().zip(&rays).find(|(h, _)| h.instance != u32::MAX);
            assert_eq!(seen.map(|(h, r)| format!("{h:?} {r:?}")), None, "moves: {moves}");
            let outward: Vec<_> = rays[..500]
                .iter()
                .map(|r| ray(Vec3::from(r.origin) + Vec3::from(r.direction) * 9.0, -Vec3::from(r.direction)))
                .collect();
            let seen = traceable.trace(&Pose::rest(&scene), &outward, 1, 0);
            assert!(seen.closest.iter().all(|h| h.instance != u32::MAX), "moves: {moves}");
        }
    });
}

#[test]
fn trees_over_equal_or_nested_boxes_neither_overflow_nor_miss() {
    with_gpu(|gpu| {
        let triangle = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let through = ray(Vec3::new(0.2, 0.2, 1.0), Vec3::NEG_Z);
        let beside = ray(Vec3::new(0.8, 0.8, 1.0), Vec3::NEG_Z);
        assert_eq!(check(gpu, "coincident", &vec![triangle; 10_000], &[through, beside]), 1);
        // Each a little larger than the one before, all around the same corner: the tree of a list.
        let nested: Vec<_> =
            (0..3000).map(|i| triangle.map(|p| p * 1.004f32.powi(i) + Vec3::Z * i as f32 * 1e-3)).collect();
        let rays = random_rays(&mut Numbers(4), 200, Vec3::splat(-1.0), Vec3::splat(4.0));
        check(gpu, "nested", &nested, &rays);
        // Points on a line, in order of size.
        let line: Vec<_> = (0..2000).map(|i| triangle.map(|p| (p * 0.1 + Vec3::X) * 1.02f32.powi(i - 1000))).collect();
        let rays: Vec<_> = (0..200).map(|i| ray(line[10 * i][1] * 0.97 + Vec3::Z, Vec3::NEG_Z)).collect();
        check(gpu, "line", &line, &rays);
        assert_eq!(check(gpu, "nothing", &[], &[through]), 0);
    });
}
