//! What imperfect visibility of Marques and Santos (2010, section 4.1) saves, by triangles of a leaf: shadow rays from visible points to virtual
//! lights, on one CPU core, in binary trees of the crate obvhs.
//!
//! `cargo bench --bench imperfect [-- [--size N] [--vpls N] [--rounds N] [--tests N] [SCENE…]]`; scenes are built-in names or files.
//! `--tests`: each triangle is tested so many times, which shows what a dearer test would change. Four ways to decide about a primitive
//! of a leaf: its triangle (*exact*); the box of the leaf stands for it, where a leaf has one, rounded to the grid of a node of eight as on the device (*tree's boxes*); its own box is tested, and its
//! triangle where the box holds an end of the ray (*own boxes*); its own box alone, and a box with an end of the ray is not there (*boxes alone*:
//! the paper stores no vertices). Each is timed and counted.

mod common;

use glam::{Vec3, vec3};
use lucerna::{
    Error, Result,
    scene::{
        self, LoadOptions, Pose, Scene, View,
        bvh::{Bvh, Ray},
    },
};
use lucerna_scenes as builtin;
use obvhs::{BvhBuildParams, aabb::Aabb, bvh2::Bvh2, bvh2::builder::build_bvh2};
use std::{
    hint::black_box,
    time::{Duration, Instant},
};

/// Parts of a ray's length that are left out at its ends.
const ENDS: f32 = 1e-3;

fn main() -> std::process::ExitCode {
    common::end(run())
}

fn run() -> Result<()> {
    let (mut size, mut vpls, mut rounds, mut tests, mut scenes) = (64, 60, 5, 1, Vec::new());
    let mut arguments = common::words();
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().unwrap_or_default();
        match argument.as_str() {
            "--size" => size = common::number("--size", &value(), 8..=512)?,
            "--vpls" => vpls = common::number("--vpls", &value(), 1..=1000)?,
            "--rounds" => rounds = common::number("--rounds", &value(), 1..=100)?,
            "--tests" => tests = common::number("--tests", &value(), 1..=64)?,
            flag if flag.starts_with("--") => {
                return common::wrong("option", flag, "--size, --vpls, --rounds, --tests");
            }
            _ => scenes.push(argument),
        }
    }
    if scenes.is_empty() {
        scenes = ["office", "conference"].map(String::from).to_vec();
    }
    for name in &scenes {
        let scene = if builtin::NAMES.contains(&name.as_str()) {
            builtin::load(name)?
        } else {
            scene::load(std::path::Path::new(name), &LoadOptions::default())?
        };
        measure(name, &scene, (size, vpls, rounds), tests)?;
    }
    Ok(())
}

/// Random numbers from 0 to 1.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 40) as f32 / (1u64 << 24) as f32
    }

    fn direction(&mut self) -> Vec3 {
        let (z, turn) = (1.0 - 2.0 * self.next(), std::f32::consts::TAU * self.next());
        let r = (1.0 - z * z).max(0.0).sqrt();
        vec3(r * turn.cos(), r * turn.sin(), z)
    }
}

/// Places of lamps: punctual lights, and the middles of triangles that glow.
fn lamps(scene: &Scene, pose: &Pose, bvh: &Bvh) -> Vec<Vec3> {
    let punctual = scene.nodes.iter().zip(&pose.world).filter(|(node, _)| node.light.is_some());
    let mut out: Vec<Vec3> = punctual.map(|(_, world)| world.w_axis.truncate()).collect();
    for (index, triangle) in bvh.triangles().iter().enumerate() {
        let id = bvh.id(index as u32);
        let Some(mesh) = scene.nodes[id.node as usize].mesh else { continue };
        let material = scene.meshes[mesh as usize].primitives[id.primitive as usize].material;
        if scene.materials.get(material as usize).is_some_and(|material| material.emissive.max_element() > 0.0) {
            let [a, b, c] = *triangle;
            out.push((a + b + c) / 3.0 + 1e-3 * (b - a).cross(c - a).normalize_or(Vec3::Y));
        }
    }
    out
}

/// Rays from points that a camera sees to lights on surfaces that lamps light.
fn rays(scene: &Scene, bvh: &Bvh, size: u32, vpls: u32) -> Result<Vec<Ray>> {
    let pose = Pose::rest(scene);
    let seen = scene.nodes.iter().zip(&pose.world).find_map(|(node, world)| Some((node.camera?, world)));
    let (camera, world) = seen.ok_or_else(|| Error::usage("the scene has no camera"))?;
    let view = View::new(&scene.cameras[camera as usize], *world, [size; 2]);
    let world_from_clip = view.clip_from_world.inverse();
    let mut random = Random(1);
    let from = lamps(scene, &pose, bvh);
    if from.is_empty() {
        return Err(Error::usage("the scene has no lamp"));
    }
    let mut lights = Vec::new();
    for _ in 0..100 * vpls {
        let lamp = from[((random.next() * from.len() as f32) as usize).min(from.len() - 1)];
        let direction = random.direction();
        if let Some(hit) = bvh.closest(&Ray::new(lamp, direction)).filter(|_| lights.len() < vpls as usize) {
            lights.push(lamp + direction * hit.t);
        }
    }
    if lights.len() < vpls as usize {
        return Err(Error::usage(format!("only {} of {vpls} virtual lights were found", lights.len())));
    }
    let mut out = Vec::new();
    for pixel in 0..size * size {
        let at = [pixel % size, pixel / size].map(|c| (c as f32 + 0.5) / size as f32 * 2.0 - 1.0);
        let through = world_from_clip.project_point3(vec3(at[0], -at[1], 0.5));
        let direction = (through - view.position).normalize();
        let Some(hit) = bvh.closest(&Ray::new(view.position, direction)) else { continue };
        let point = view.position + direction * hit.t;
        out.extend(lights.iter().map(|light| Ray {
            origin: point,
            direction: *light - point,
            t_min: ENDS,
            t_max: 1.0 - ENDS,
        }));
    }
    Ok(out)
}

/// How a primitive of a leaf is decided about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Way {
    Exact,
    TreeBoxes,
    OwnBoxes,
    BoxesAlone,
}

/// Tests of all rays.
#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    nodes: u64,
    boxes: u64,
    triangles: u64,
    blocked: u64,
}

/// Where a line enters and leaves a box.
fn slab(min: Vec3, max: Vec3, origin: Vec3, inverse: Vec3) -> (f32, f32) {
    let (a, b) = ((min - origin) * inverse, (max - origin) * inverse);
    (a.min(b).max_element(), a.max(b).min_element())
}

/// The boxes of leaves as nodes of eight store them: rounded outwards to steps that are powers of two, 255 of which span the box of the ancestor
/// three levels above.
fn rounded(tree: &Bvh2) -> Vec<[Vec3; 2]> {
    let corners = |index: u32| -> [Vec3; 2] {
        let aabb = tree.nodes[index as usize].aabb();
        [aabb.min.into(), aabb.max.into()]
    };
    let mut out = vec![[Vec3::ZERO; 2]; tree.nodes.len()];
    let mut stack = vec![(0u32, [0u32; 3])];
    while let Some((index, [above, second, third])) = stack.pop() {
        let node = &tree.nodes[index as usize];
        if !node.is_leaf() {
            stack.extend([node.first_index, node.first_index + 1].map(|child| (child, [index, above, second])));
            continue;
        }
        let ([low, high], [min, max]) = (corners(third), corners(index));
        let step = ((high - low) / 255.0).max(Vec3::splat(1e-20)).log2().ceil().exp2();
        out[index as usize] = [low + ((min - low) / step).floor() * step, low + ((max - low) / step).ceil() * step];
    }
    out
}

/// Möller and Trumbore.
fn meets([a, b, c]: &[Vec3; 3], ray: &Ray) -> bool {
    let (u, v) = (*b - *a, *c - *a);
    let p = ray.direction.cross(v);
    let inverse = 1.0 / u.dot(p);
    let s = ray.origin - *a;
    let q = s.cross(u);
    let (x, y, t) = (s.dot(p) * inverse, ray.direction.dot(q) * inverse, v.dot(q) * inverse);
    x >= 0.0 && y >= 0.0 && x + y <= 1.0 && t >= ray.t_min && t <= ray.t_max
}

/// Whether something is in the way. `COUNT`: tests are counted.
fn blocked<const COUNT: bool>(
    (tree, rounded): (&Bvh2, &[[Vec3; 2]]),
    (triangles, tests): (&[[Vec3; 3]], u32),
    ray: &Ray,
    way: Way,
    counts: &mut Counts,
) -> bool {
    let inverse = ray.direction.recip();
    let mut stack = [0u32; 128];
    let mut height = 1;
    while height > 0 {
        height -= 1;
        let index = stack[height] as usize;
        let node = &tree.nodes[index];
        counts.nodes += u64::from(COUNT);
        let [min, max] = match way {
            Way::TreeBoxes if node.is_leaf() => rounded[index],
            _ => [node.aabb().min.into(), node.aabb().max.into()],
        };
        let (near, far) = slab(min, max, ray.origin, inverse);
        if near.max(ray.t_min) > far.min(ray.t_max) {
            continue;
        }
        if !node.is_leaf() {
            assert!(height + 2 <= stack.len(), "the tree is too deep");
            stack[height] = node.first_index + 1;
            stack[height + 1] = node.first_index;
            height += 2;
            continue;
        }
        for slot in node.first_index..node.first_index + node.prim_count {
            let triangle = &triangles[tree.primitive_indices[slot as usize] as usize];
            let between = |near: f32, far: f32| near > ray.t_min && far < ray.t_max;
            if way != Way::Exact {
                let (mut near, mut far) = (near, far);
                if way != Way::TreeBoxes {
                    let [a, b, c] = *triangle;
                    counts.boxes += u64::from(COUNT);
                    (near, far) = slab(a.min(b).min(c), a.max(b).max(c), ray.origin, inverse);
                    if near.max(ray.t_min) > far.min(ray.t_max) {
                        continue;
                    }
                }
                if between(near, far) {
                    return true;
                }
                if way == Way::BoxesAlone {
                    continue;
                }
            }
            counts.triangles += u64::from(COUNT);
            let mut met = false;
            for _ in 0..tests {
                met = black_box(meets(black_box(triangle), ray));
            }
            if met {
                return true;
            }
        }
    }
    false
}

fn measure(name: &str, scene: &Scene, (size, vpls, rounds): (u32, u32, u32), tests: u32) -> Result<()> {
    let bvh = Bvh::build(scene, &Pose::rest(scene));
    let rays = rays(scene, &bvh, size, vpls)?;
    let triangles = bvh.triangles();
    let boxes: Vec<Aabb> =
        triangles.iter().map(|[a, b, c]| Aabb::new(a.min(*b).min(*c).into(), a.max(*b).max(*c).into())).collect();
    println!(
        "\n{name}: {} triangles, {} rays, one core, best of {rounds} rounds; tests are those of a ray",
        triangles.len(),
        rays.len()
    );
    println!(
        "| triangles of a leaf, at most | mean | way | ns | speed | nodes | boxes of triangles | triangles | blocked (%) |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for most in [1, 2, 4, 8, 16] {
        let params = BvhBuildParams {
            max_prims_per_leaf: most,
            // Leaves become full.
            collapse_traversal_cost: if most == 1 { 1.0 } else { 1e3 },
            ..BvhBuildParams::medium_build()
        };
        let tree = build_bvh2(&boxes, params, &mut Duration::default());
        let rounded = rounded(&tree);
        let leaves = tree.nodes.iter().filter(|node| node.is_leaf()).count();
        let ways = [Way::Exact, Way::TreeBoxes, Way::OwnBoxes, Way::BoxesAlone];
        let ways = ways.into_iter().filter(|way| *way != Way::TreeBoxes || most == 1);
        let mut rows: Vec<(Way, Counts, f64)> = ways.map(|way| (way, Counts::default(), f64::INFINITY)).collect();
        for (way, counts, _) in &mut rows {
            for ray in &rays {
                let hit = blocked::<true>((&tree, &rounded), (triangles, tests), ray, *way, counts);
                counts.blocked += u64::from(hit);
            }
        }
        // In alternation, so that other work on the machine falls on all.
        for _ in 0..rounds {
            for (way, counts, best) in &mut rows {
                let start = Instant::now();
                let mut sum = 0;
                for ray in &rays {
                    let mut none = Counts::default();
                    sum += u64::from(blocked::<false>((&tree, &rounded), (triangles, tests), ray, *way, &mut none));
                }
                *best = best.min(start.elapsed().as_secs_f64());
                assert_eq!(sum, counts.blocked, "rays are blocked as before");
            }
        }
        let (count, exact) = (rays.len() as f64, rows[0].2);
        for (way, counts, best) in rows {
            let of = |tests: u64| tests as f64 / count;
            println!(
                "| {most} | {:.2} | {way:?} | {:.0} | {:.2} | {:.1} | {:.2} | {:.2} | {:.1} |",
                triangles.len() as f64 / leaves as f64,
                best * 1e9 / count,
                exact / best,
                of(counts.nodes),
                of(counts.boxes),
                of(counts.triangles),
                100.0 * of(counts.blocked),
            );
        }
    }
    Ok(())
}
