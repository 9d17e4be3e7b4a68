//! Shooting and gathering of virtual lights against a CPU reference that shares no code with the shaders: it uses other formulas and
//! double precision, and tests every triangle for every ray.

use crate::igi_lab::{Studio, plain};
use crate::tracer_lab::{Stage, view};
use glam::{DMat3, DVec3, Mat4, Quat, Vec3, vec3};
use lucerna::{
    gpu::testing::with_gpu,
    scene::{LightKind, Material, Scene, View},
    shaders::types,
    techniques::igi::Settings,
};
use std::f64::consts::PI;

/// A triangle in world space, with its albedo.
struct Triangle {
    corners: [DVec3; 3],
    normals: [DVec3; 3],
    albedo: DVec3,
}

/// Distance (in lengths of `direction`) and barycentric coordinates.
fn meet(triangle: &Triangle, origin: DVec3, direction: DVec3) -> Option<(f64, f64, f64)> {
    let [a, b, c] = triangle.corners;
    // Cramer's rule.
    let matrix = DMat3::from_cols(b - a, c - a, -direction);
    let determinant = matrix.determinant();
    if determinant.abs() < 1e-18 {
        return None;
    }
    let s = matrix.inverse() * (origin - a);
    (s.x >= 0.0 && s.y >= 0.0 && s.x + s.y <= 1.0 && s.z > 0.0).then_some((s.z, s.x, s.y))
}

fn triangles(scene: &Scene) -> Vec<Triangle> {
    let mut out = Vec::new();
    for node in &scene.nodes {
        let Some(mesh) = node.mesh else { continue };
        for primitive in &scene.meshes[mesh as usize].primitives {
            let albedo = scene.materials[primitive.material as usize].base_color.truncate().as_dvec3();
            for c in primitive.indices.chunks_exact(3) {
                let corners = [0, 1, 2].map(|k| primitive.positions[c[k] as usize].as_dvec3());
                let normals = [0, 1, 2].map(|k| primitive.normals[c[k] as usize].as_dvec3());
                out.push(Triangle { corners, normals, albedo });
            }
        }
    }
    out
}

/// Digits of a number in a base, mirrored at the point.
fn mirrored(base: u64, mut number: u64) -> f64 {
    let (mut out, mut place) = (0.0, 1.0 / base as f64);
    while number > 0 {
        out += (number % base) as f64 * place;
        place /= base as f64;
        number /= base;
    }
    out
}

/// Two axes perpendicular to a unit vector, chosen like in the engine: x and y after the shortest rotation of +z (or -z) to the vector.
fn across(n: DVec3) -> (DVec3, DVec3) {
    let pole = if n.z >= 0.0 { DVec3::Z } else { DVec3::NEG_Z };
    let turn = glam::DQuat::from_rotation_arc(pole, n);
    let sign = pole.z;
    (turn * DVec3::X, turn * DVec3::Y * sign)
}

/// A cosine-distributed direction about n from two numbers, by the concentric mapping of a square to a disc.
fn cosine_direction(n: DVec3, [u, v]: [f64; 2]) -> DVec3 {
    let (a, b) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    let (radius, angle) = if a.abs() > b.abs() {
        (a, PI / 4.0 * b / a)
    } else if b != 0.0 {
        (b, PI / 2.0 - PI / 4.0 * a / b)
    } else {
        (0.0, 0.0)
    };
    let (x, y) = (radius * angle.cos(), radius * angle.sin());
    let (s, t) = across(n);
    s * x + t * y + n * (1.0 - x * x - y * y).max(0.0).sqrt()
}

/// A lamp: its position, axis and intensity along the axis, and the angles of its cone (`None`: all directions).
struct Lamp {
    at: DVec3,
    along: DVec3,
    intensity: DVec3,
    cone: Option<(f64, f64)>,
}

impl Lamp {
    /// Share of the axial intensity at a cosine to the axis.
    fn fall(&self, cosine: f64) -> f64 {
        self.cone.map_or(1.0, |(inner, outer)| {
            ((cosine - outer.cos()) / (inner.cos() - outer.cos())).clamp(0.0, 1.0).powi(2)
        })
    }

    /// Integral over directions whose cosine with the axis is at most `cosine`, by Simpson's rule.
    fn flux_up_to(&self, cosine: f64) -> f64 {
        let steps = 2000;
        let h = (cosine + 1.0) / f64::from(steps);
        let at = |i: i32| self.fall(-1.0 + h * f64::from(i));
        let inner: f64 = (1..steps).map(|i| at(i) * if i % 2 == 1 { 4.0 } else { 2.0 }).sum();
        2.0 * PI * h / 3.0 * (at(0) + inner + at(steps))
    }

    fn power(&self) -> f64 {
        self.flux_up_to(1.0) * self.intensity.element_sum()
    }

    fn direction(&self, [u, v]: [f64; 2]) -> DVec3 {
        let Some(_) = self.cone else {
            let z = 1.0 - 2.0 * u;
            let r = (1.0 - z * z).max(0.0).sqrt();
            return DVec3::new(r * (2.0 * PI * v).cos(), r * (2.0 * PI * v).sin(), z);
        };
        // Bisection for the cosine below which the share u of the flux lies.
        let (mut low, mut high) = (-1.0, 1.0);
        let wanted = u * self.flux_up_to(1.0);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if self.flux_up_to(middle) < wanted { low = middle } else { high = middle }
        }
        let (s, t) = across(self.along);
        let r = (1.0 - low * low).max(0.0).sqrt();
        s * (r * (2.0 * PI * v).cos()) + t * (r * (2.0 * PI * v).sin()) + self.along * low
    }
}

struct Shot {
    position: DVec3,
    normal: DVec3,
    flux: DVec3,
}

/// Virtual lights of `paths` paths: first the lights at the first hits of all paths, then those at the second hits, and so on.
fn shoot(world: &[Triangle], lamps: &[Lamp], paths: usize, bounces: usize) -> Vec<Option<Shot>> {
    const PRIMES: [u64; 12] = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37];
    let total: f64 = lamps.iter().map(Lamp::power).sum();
    let mut out: Vec<Option<Shot>> = (0..paths * bounces).map(|_| None).collect();
    for path in 0..paths {
        let pair = |k: usize| [0, 1].map(|i| mirrored(PRIMES[2 * k + i], path as u64 + 1));
        // Systematic sampling: equal steps through the running sum of the powers, from the middle of the first step.
        let mut left = (path as f64 + 0.5) / paths as f64 * total;
        let mut lamp = &lamps[0];
        for one in lamps {
            lamp = one;
            if left < one.power() {
                break;
            }
            left -= one.power();
        }
        // All paths of a lamp carry the same flux.
        let mut flux = lamp.intensity / lamp.intensity.element_sum() * total / paths as f64;
        let (mut origin, mut direction) = (lamp.at, lamp.direction(pair(0)));
        for bounce in 0..bounces {
            let hit = world.iter().filter_map(|t| meet(t, origin, direction).map(|m| (m, t)));
            let Some(((t, u, v), triangle)) = hit.min_by(|a, b| a.0.0.total_cmp(&b.0.0)) else { break };
            let [a, b, c] = triangle.corners;
            let mut side = (b - a).cross(c - a).normalize();
            let mut normal =
                (triangle.normals[0] * (1.0 - u - v) + triangle.normals[1] * u + triangle.normals[2] * v).normalize();
            if side.dot(direction) > 0.0 {
                (side, normal) = (-side, -normal);
            }
            let slant = normal.dot(-direction).max(0.0) / side.dot(-direction);
            flux *= triangle.albedo * slant.min(4.0);
            let position = origin + direction * t;
            out[bounce * paths + path] = Some(Shot { position, normal: side, flux });
            origin = position + side * 1e-6;
            direction = cosine_direction(side, pair(2 + bounce));
        }
    }
    out
}

/// A room with a block, a ball and two lamps.
fn room() -> (Scene, Vec<Lamp>) {
    let mut stage = Stage::new();
    let white = stage.material(Material::diffuse("white", vec3(0.8, 0.7, 0.6)));
    let red = stage.material(Material::diffuse("red", vec3(0.7, 0.2, 0.1)));
    stage.cuboid(white, vec3(-1.0, -0.8, -1.2), vec3(1.0, 0.9, 1.0), true);
    stage.cuboid(red, vec3(-0.7, -0.8, -0.6), vec3(-0.1, 0.1, -0.1), false);
    stage.sphere(red, vec3(0.45, -0.45, 0.1), 0.3, 12, false);
    stage.point(vec3(0.21, 0.52, 0.33), vec3(1.0, 2.0, 3.0));
    let at = vec3(-0.4, 0.7, 0.5);
    let (inner, outer) = (0.35f32, 0.9f32);
    let turn = Quat::from_rotation_arc(Vec3::NEG_Z, vec3(0.3, -0.8, -0.4).normalize());
    let kind = LightKind::Spot { range: None, inner, outer };
    stage.light(kind, vec3(1.0, 0.5, 0.25), 9.0, Mat4::from_rotation_translation(turn, at));
    let lamps = vec![
        Lamp { at: DVec3::new(0.21, 0.52, 0.33), along: DVec3::Z, intensity: DVec3::new(1.0, 2.0, 3.0), cone: None },
        Lamp {
            at: at.as_dvec3(),
            along: DVec3::new(0.3, -0.8, -0.4).normalize(),
            intensity: DVec3::new(9.0, 4.5, 2.25),
            cone: Some((f64::from(inner), f64::from(outer))),
        },
    ];
    (stage.scene, lamps)
}

fn near(found: [f32; 3], expected: DVec3, slack: f64) -> bool {
    (Vec3::from(found).as_dvec3() - expected).length() <= slack
}

#[test]
fn paths_of_light_leave_virtual_lights_where_a_cpu_reference_does() {
    with_gpu(|gpu| {
        let (scene, lamps) = room();
        let world = triangles(&scene);
        let (paths, bounces) = (400usize, 3usize);
        let settings = Settings { bounces: bounces as u32, ..plain((paths * bounces) as u32) };
        let seen = view(vec3(0.0, 0.0, 0.9), Vec3::NEG_Z, 60.0, [4, 4]);
        let found = Studio::new(gpu, &scene).render(&seen, &settings, 0).vpls;
        let expected = shoot(&world, &lamps, paths, bounces);
        assert_eq!(found.len(), expected.len());
        let mut others = [0; 3];
        for (i, (found, expected)) in found.iter().zip(&expected).enumerate() {
            let expected = expected.as_ref().expect("the room is closed");
            // Rounding decides which triangle a ray along an edge hits, and so the rest of its path.
            let same = near(found.position, expected.position, 3e-4)
                && near(found.normal, expected.normal, 1e-4)
                && near(found.flux, expected.flux, 2e-4 * expected.flux.length());
            if !same {
                others[i / paths] += 1;
                println!("{i}: {found:?} instead of {} {} {}", expected.position, expected.normal, expected.flux);
            }
            assert_eq!((found.depth as usize, found.path as usize), (i / paths, i % paths));
        }
        println!("{others:?} of {paths} paths went another way at the first, second and third surface");
        assert!(others[0] <= 1 && others[1] <= 3 && others[2] <= 8, "{others:?}");
        // The CPU reference itself conserves the power.
        let total: f64 = lamps.iter().map(Lamp::power).sum();
        assert!((lamps[0].power() - 4.0 * PI * 6.0).abs() < 1e-6 && total > lamps[0].power());
    });
}

/// Irradiance of a point from virtual lights. Only the list of lights comes from the engine.
fn gathered(world: &[Triangle], vpls: &[&types::Vpl], x: DVec3, n: DVec3, least: f64) -> DVec3 {
    let mut sum = DVec3::ZERO;
    for vpl in vpls {
        let (place, sends) = (Vec3::from(vpl.position).as_dvec3(), Vec3::from(vpl.normal).as_dvec3());
        let way = place - x;
        let distance = way.length();
        let (here, there) = (n.dot(way) / distance, -sends.dot(way) / distance);
        if here <= 0.0 || there <= 0.0 {
            continue;
        }
        // Both ends of the ray are moved off their surfaces.
        let (from, to) = (x + n * 2e-5, place + sends * 2e-5);
        if world.iter().any(|t| meet(t, from, to - from).is_some_and(|(at, ..)| at < 1.0)) {
            continue;
        }
        let t = ((distance - 0.8 * least) / (0.4 * least)).clamp(0.0, 1.0);
        let smooth = if least > 0.0 { t * t * (3.0 - 2.0 * t) } else { 1.0 };
        sum += Vec3::from(vpl.flux).as_dvec3() / PI * (here * there / (distance * distance) * smooth);
    }
    sum
}

/// Position, normal and albedo at the first hit of the ray through a pixel.
fn seen_at(world: &[Triangle], view: &View, pixel: [u32; 2]) -> (DVec3, DVec3, DVec3) {
    let uv =
        (glam::vec2(pixel[0] as f32, pixel[1] as f32) + 0.5) / glam::vec2(view.extent[0] as f32, view.extent[1] as f32);
    let from = view.position.as_dvec3();
    let direction = view.world_from_depth(uv, 1.0).as_dvec3() - from;
    let hits = world.iter().filter_map(|t| meet(t, from, direction).map(|m| (m, t)));
    let ((t, u, v), triangle) = hits.min_by(|a, b| a.0.0.total_cmp(&b.0.0)).expect("the room is closed");
    let normal = triangle.normals[0] * (1.0 - u - v) + triangle.normals[1] * u + triangle.normals[2] * v;
    (from + direction * t, normal.normalize(), triangle.albedo)
}

#[test]
fn pixels_gather_what_a_cpu_reference_does() {
    with_gpu(|gpu| {
        let (scene, _) = room();
        let world = triangles(&scene);
        let seen = view(vec3(0.1, 0.3, 0.9), vec3(-0.1, -0.4, -0.6), 75.0, [20, 15]);
        let mut studio = Studio::new(gpu, &scene);
        let diagonal = DVec3::new(2.0, 1.7, 2.2).length();
        for bound in [0.0f32, 0.05] {
            let settings = Settings { bounces: 2, bound, ..plain(120) };
            let shown = studio.render(&seen, &settings, 0);
            let vpls: Vec<&types::Vpl> = shown.vpls.iter().collect();
            let (mut others, mut ours, mut theirs) = (0, 0.0, 0.0);
            for (i, pixel) in shown.irradiance.iter().enumerate() {
                let (x, n, _) = seen_at(&world, &seen, [i as u32 % 20, i as u32 / 20]);
                let expected = gathered(&world, &vpls, x, n, f64::from(bound) * diagonal);
                let found = Vec3::new(pixel[0], pixel[1], pixel[2]).as_dvec3();
                ours += found.element_sum();
                theirs += expected.element_sum();
                // Normals and depths are rounded to 32 bits, which decides whether a virtual light on the horizon or at an edge is visible.
                if (found - expected).length() > 3e-3 * expected.length() + 1e-6 {
                    others += 1;
                }
            }
            println!(
                "bound {bound}: {others} of {} pixels differ, sums {ours:.5} and {theirs:.5}",
                shown.irradiance.len()
            );
            assert!(others * 50 <= shown.irradiance.len(), "{others} pixels differ");
            assert!((ours / theirs - 1.0).abs() < 1e-3, "{ours} instead of {theirs}");
        }
    });
}

#[test]
fn a_pixel_of_a_tile_gathers_its_own_lights_alone() {
    with_gpu(|gpu| {
        let (scene, _) = room();
        let world = triangles(&scene);
        let seen = view(vec3(0.1, 0.3, 0.9), vec3(-0.1, -0.4, -0.6), 75.0, [18, 12]);
        let mut studio = Studio::new(gpu, &scene);
        let mut lists = Vec::new();
        for sorted in [false, true] {
            let settings = Settings { interleave: 3, sorted, ..plain(90) };
            let shown = studio.render(&seen, &settings, 0);
            let (mut others, mut all) = (0, 0);
            for (i, pixel) in shown.gathered.iter().enumerate() {
                let at = [i as u32 % 18, i as u32 / 18];
                let subset = (at[1] % 3 * 3 + at[0] % 3) as usize;
                let own: Vec<&types::Vpl> = shown.vpls.iter().skip(subset).step_by(9).collect();
                let (x, n, _) = seen_at(&world, &seen, at);
                let expected = gathered(&world, &own, x, n, 0.0) * 9.0;
                let found = Vec3::new(pixel[0], pixel[1], pixel[2]).as_dvec3();
                all += 1;
                others += usize::from((found - expected).length() > 3e-3 * expected.length() + 1e-6);
            }
            println!("sorted {sorted}: {others} of {all} pixels differ");
            assert!(others * 40 <= all, "sorted {sorted}: {others} of {all} pixels differ");
            lists.push(shown.vpls);
        }
        // The same lights in another order.
        let way = |list: &[types::Vpl]| -> f32 {
            let apart = |pair: &[types::Vpl]| Vec3::from(pair[0].position).distance(pair[1].position.into());
            list.windows(2).map(apart).sum()
        };
        let paths = |list: &[types::Vpl]| {
            let mut all: Vec<u32> = list.iter().map(|vpl| vpl.path).collect();
            all.sort_unstable();
            all
        };
        println!("from light to light {} m, sorted {} m", way(&lists[0]), way(&lists[1]));
        assert!(paths(&lists[0]) == paths(&lists[1]) && way(&lists[1]) < 0.5 * way(&lists[0]));
    });
}

fn luminance(color: DVec3) -> f64 {
    color.dot(DVec3::new(0.2126, 0.7152, 0.0722))
}

#[test]
fn lights_are_chosen_as_a_cpu_reference_chooses_them() {
    with_gpu(|gpu| {
        let (scene, _) = room();
        let world = triangles(&scene);
        let seen = view(vec3(0.1, 0.3, 0.9), vec3(-0.1, -0.4, -0.6), 75.0, [20, 15]);
        let mut studio = Studio::new(gpu, &scene);
        let (vpls, candidates, judges) = (120u32, 4, 24);
        let base = Settings { bounces: 2, ..plain(vpls) };
        let found = studio.render(&seen, &Settings { candidates, judges, ..base.clone() }, 0).vpls;
        // The virtual lights of all candidate paths.
        let all = studio.render(&seen, &Settings { vpls: vpls * candidates, ..base }, 0).vpls;
        let least = 0.03 * DVec3::new(2.0, 1.7, 2.2).length();
        let mut important = vec![0.0; all.len()];
        for judge in 0..judges {
            // The R2 sequence, with the plastic number, the root of x³ = x + 1; it is more even than random points.
            let plastic = 1.324_717_957_244_746_f64;
            let place = |power: i32, side: u32| {
                ((0.5 + f64::from(judge) / plastic.powi(power)).fract() * f64::from(side)) as u32
            };
            let (x, n, albedo) = seen_at(&world, &seen, [place(1, 20), place(2, 15)]);
            for (important, vpl) in important.iter_mut().zip(&all) {
                // Importance is damped near a point, so that it does not grow without limit.
                let q = (Vec3::from(vpl.position).as_dvec3().distance_squared(x) / (least * least)).min(1.0);
                let light = luminance(gathered(&world, &[vpl], x, n, 0.0));
                *important += light * luminance(albedo).max(0.05) * q * q;
            }
        }
        let flux = |vpl: &types::Vpl| Vec3::from(vpl.flux).as_dvec3().element_sum();
        let (light, power): (f64, f64) = (important.iter().sum(), all.iter().map(flux).sum());
        // Half of the probability follows the importance, half the flux.
        let weights: Vec<f64> =
            all.iter().zip(&important).map(|(vpl, i)| 0.5 * i / light + 0.5 * flux(vpl) / power).collect();
        let (mut at, mut before, mut others) = (0, 0.0, 0);
        for (i, found) in found.iter().enumerate() {
            let wanted = (i as f64 + 0.5) / f64::from(vpls);
            while at + 1 < all.len() && before + weights[at] <= wanted {
                before += weights[at];
                at += 1;
            }
            let expected = Vec3::from(all[at].flux).as_dvec3() / (weights[at] * f64::from(vpls));
            let same = found.path == all[at].path
                && found.position == all[at].position
                && near(found.flux, expected, 5e-3 * expected.length());
            if !same {
                others += 1;
                println!("{i}: {found:?} instead of {:?} with {expected}", all[at]);
            }
        }
        println!("{others} of {} lights are others", found.len());
        // The device rounds sums to 32 bits and the albedo to 8 bits.
        assert!(found.len() == vpls as usize && others * 100 <= found.len(), "{others} of {} lights", found.len());
        // The weights are uneven, so the test would notice draws with equal weights.
        let even = |factor: f64| factor / all.len() as f64;
        assert!(weights.iter().any(|w| *w > even(1.5)) && weights.iter().any(|w| *w < even(0.7)));
    });
}
