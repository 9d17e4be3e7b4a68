//! Many occluders: the lists of relevant occluders and of overlapping pairs are complete, light is hidden once, and
//! negligible occluders fade out continuously.

use crate::fiv_lab;
use crate::fiv_lab::{Studio, ball, ground, thing};
use crate::tracer_lab::flat_view;
use glam::{DVec3, Mat4, Vec3, vec3};
use lucerna::{
    gpu::testing::with_gpu,
    reference::{
        fiv as twin,
        overlap::{self, Seen},
    },
    scene::{Environment, Pose, Scene},
    techniques::fiv::{Cut, Extent, Light, Settings, Shared, Sky, fill, spots},
};

const RADIUS: f32 = 0.3;

fn settings(shared: Shared) -> Settings {
    Settings {
        size: 16,
        azimuths: 16,
        polars: 9,
        radii: 8,
        largest: 1.0,
        adaptive: false,
        extent: Extent::Sphere,
        cut: Cut::Height,
        self_shadow: false,
        shared,
        ..Settings::default()
    }
}

/// Constant radiance with a sun, or constant radiance alone.
fn light(sun: bool) -> Environment {
    lit(if sun { Sun::Small } else { Sun::No })
}

/// The sun in an environment.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Sun {
    No,
    /// Its disc is smaller than the discs of the balls.
    Small,
    /// Its disc is larger than those of most balls: each hides a part of it.
    Wide,
}

fn lit(sun: Sun) -> Environment {
    let towards = DVec3::new(0.2, 0.9, 0.3).normalize();
    fiv_lab::painted(128, |d| {
        let bright = match sun {
            Sun::Small if d.dot(towards) > 0.99 => 60.0,
            Sun::Wide if d.dot(towards) > 0.93 => 20.0,
            _ => 0.0,
        };
        Vec3::new(1.0, 0.7, 1.3) + bright
    })
}

/// Balls above, around and below the ground near the origin. Most of them overlap others as seen from the origin.
fn places(count: u32) -> Vec<Vec3> {
    let place = |i: u32| {
        let (turn, far) = (2.399 * i as f32, 0.35 * (i as f32).sqrt());
        vec3(far * turn.cos(), if i % 5 == 4 { -0.2 } else { 0.5 + 0.13 * (i % 7) as f32 }, far * turn.sin())
    };
    (0..count).map(place).collect()
}

fn stage(environment: Environment, places: &[Vec3]) -> Scene {
    let mut scene = Scene { environment: Some(environment), ..Scene::default() };
    ground(&mut scene, 20.0);
    for (i, at) in places.iter().enumerate() {
        let (positions, indices) = ball(RADIUS, 8);
        thing(&mut scene, &format!("ball {i}"), positions, indices, Mat4::from_translation(*at));
    }
    scene
}

/// Pixels along an edge of the picture, and metres of ground that the picture shows from below all balls.
const EXTENT: u32 = 20;
const SIZE: f32 = 2.5;
const EYE: Vec3 = Vec3::new(0.0, 0.02, 0.0);

/// Position of the ground that a pixel shows.
fn shown(pixel: u32) -> Vec3 {
    let at = |k: u32| ((k as f32 + 0.5) / EXTENT as f32 - 0.5) * SIZE;
    vec3(-at(pixel % EXTENT), 0.0, -at(pixel / EXTENT))
}

#[test]
fn lists_of_pairs_give_the_picture_of_all_pairs() {
    with_gpu(|gpu| {
        for (sun, shared, count) in [
            (Sun::No, Shared::Discs, 60),
            (Sun::No, Shared::Filled, 33),
            (Sun::Small, Shared::Lights, 60),
            (Sun::Wide, Shared::Lights, 60),
            // The occluders need more than one call of the irradiance pass.
            (Sun::Small, Shared::Lights, 150),
        ] {
            let scene = stage(lit(sun), &places(count));
            let settings = settings(shared);
            let sky = Sky::new(scene.environment.as_ref(), settings.size).unwrap();
            let mut studio = Studio::new(gpu, &scene, &settings, None);
            let (plan, all) = (studio.fiv.plan().clone(), studio.fiv.occluders().clone());
            assert_eq!((all.kinds.len(), all.placed.len()), (1, count as usize));
            let mut fivs = vec![];
            plan.compute(gpu, &Light::new(gpu, &sky).unwrap(), &all.kinds, 0..plan.samples(), |_, new| {
                fivs.extend_from_slice(new);
                Ok(true)
            })
            .unwrap();
            let kind = &plan.occluders[0];
            let set =
                twin::Set { grid: plan.grid, shells: kind.shells, spacing: &kind.spacing, solid: None, fivs: &fivs };
            let fill = f64::from(fill::fill(&all.kinds[0]));
            let (open, spots) = (twin::irradiance(&sky, DVec3::Y), spots::spots(&sky));
            assert_eq!(spots.len(), usize::from(sun != Sun::No));
            let view = flat_view(EYE, vec3(0.0, 0.0, 0.0), SIZE, [EXTENT; 2]);
            let found = studio.irradiance(&view, &settings);
            let (mut dark, mut worst) = (0, 0f64);
            for (pixel, found) in found.iter().enumerate() {
                let p = shown(pixel as u32);
                // Balls that the ground cuts may hide the ground from the camera.
                if places(count).iter().any(|at| at.distance(p) < 1.05 * RADIUS) {
                    continue;
                }
                let from = |at: &Vec3| (*at + all.placed[0].centre - p).as_dvec3();
                // Receivers with most samples inside a ball are dark.
                if places(count).iter().any(|at| set.lookup(from(at)).1 < 0.501) {
                    continue;
                }
                let seen = |at: &Vec3| {
                    let offset = from(at);
                    let hidden = twin::dot(&set.lookup(offset).0, DVec3::Y);
                    Seen {
                        offset,
                        radius: f64::from(kind.radius),
                        fill,
                        hidden,
                        soft: std::f64::consts::PI / f64::from(plan.grid.azimuths),
                    }
                };
                let occluders: Vec<Seen> = places(count).iter().map(seen).collect();
                let exact = overlap::left(open, DVec3::Y, &occluders, &spots, shared);
                let off = (found.as_dvec3() - exact).length() / open.length();
                worst = worst.max(off);
                dark += u32::from(exact.length() < 0.5 * open.length());
            }
            eprintln!("{sun:?} sun, {shared:?}, {count} balls: {worst:.5} apart at most, {dark} pixels dark");
            assert!(worst < 5e-3 && dark > 20, "{shared:?} {count}: {worst} {dark}");
        }
    });
}

#[test]
fn a_light_behind_two_things_is_hidden_once() {
    with_gpu(|gpu| {
        // Thin crosses one above the other: their discs are nearly empty, and both cover the sun.
        let towards = vec3(0.2, 0.9, 0.3).normalize();
        let mut scene = Scene { environment: Some(light(true)), ..Scene::default() };
        ground(&mut scene, 20.0);
        for far in [1.4f32, 2.0, 2.6] {
            let (mut positions, mut indices) = ball(0.8, 8);
            positions.iter_mut().for_each(|p| *p *= vec3(1.0, 0.2, 0.25));
            let (first, across) = (positions.len() as u32, positions.clone());
            positions.extend(across.iter().map(|p| vec3(p.z, p.y, -p.x)));
            indices.extend(indices.clone().iter().map(|i| i + first));
            let at = Mat4::from_translation(towards * far);
            thing(&mut scene, &format!("cross {far}"), positions, indices, at);
        }
        let view = flat_view(vec3(0.0, 0.02, 0.0), Vec3::ZERO, 0.2, [4, 4]);
        let mean = |settings: &Settings, of: usize| {
            let mut pose = Pose::rest(&scene);
            pose.world[1 + of..].iter_mut().for_each(|world| world.w_axis.y = -1e4);
            let mut studio = Studio::new(gpu, &scene, settings, None);
            let picture = studio.shot(&pose, &view, settings).0;
            picture.iter().map(|e| e.y).sum::<f32>() / picture.len() as f32
        };
        let truth = Settings { method: lucerna::techniques::fiv::Method::BruteForce, ..settings(Shared::Lights) };
        let [open, one, all] = [0, 1, 3].map(|of| mean(&truth, of));
        let [lights, filled] = [Shared::Lights, Shared::Filled].map(|s| mean(&Settings { split: 2, ..settings(s) }, 3));
        eprintln!("open {open}, behind one {one}, behind three {all}; lights {lights}, filled {filled}");
        // More crosses behind the first change hardly anything.
        assert!(one < 0.7 * open && all > 0.8 * one);
        assert!((lights - all).abs() < 0.12 * open && filled < all - 0.2 * open);
    });
}

#[test]
fn what_is_left_out_is_less_than_its_share() {
    with_gpu(|gpu| {
        // A low sun over a wide field of balls. Balls in front of the sun are never negligible.
        let towards = DVec3::new(0.9, 0.35, 0.2).normalize();
        let low = fiv_lab::painted(128, |d| Vec3::ONE * if d.dot(towards) > 0.995 { 200.0 } else { 1.0 });
        let field: Vec<Vec3> =
            (0..81).map(|i| vec3(1.9 * (i % 9) as f32 - 7.6, 0.32, 1.9 * (i / 9) as f32 - 7.6)).collect();
        let scene = stage(low, &field);
        let full = Settings { overlap: false, ..settings(Shared::Lights) };
        let sky = Sky::new(scene.environment.as_ref(), full.size).unwrap();
        let mean = 0.25 * sky.texels().iter().map(|t| t.radiance[0] * Vec3::from(t.area).length()).sum::<f32>();
        let mut studio = Studio::new(gpu, &scene, &full, None);
        let eye = flat_view(vec3(0.0, 0.01, 0.0), Vec3::ZERO, 1.0, [8, 8]);
        let mut last = f32::INFINITY;
        let all = studio.irradiance(&eye, &full);
        let centre = studio.fiv.occluders().placed[0].centre;
        // Upper bound of the light that negligible balls hide, relative to the mean irradiance: the projected discs
        // under constant radiance, and all light of the sun.
        let missing = |pixel: usize, share: f32| {
            let at = |k: usize| 0.5 - (k as f32 + 0.5) / 8.0;
            let p = vec3(at(pixel % 8), 0.0, at(pixel / 8));
            let hidden = |ball: &Vec3| {
                let d = *ball + centre - p;
                let sine = (RADIUS / d.length()).min(1.0);
                let before = d.angle_between(towards.as_vec3()) < sine.asin() + 0.25;
                let most = std::f32::consts::PI * sine * sine * if before { 200.0 } else { 1.0 } / mean;
                if most > share { 0.0 } else { most * d.normalize().y }
            };
            field.iter().map(hidden).sum::<f32>()
        };
        for share in [0.02, 0.005] {
            let settings = Settings { negligible: share, ..full.clone() };
            let some = studio.irradiance(&eye, &settings);
            let more: Vec<f32> = some.iter().zip(&all).map(|(s, a)| (s.x - a.x) / mean).collect();
            let most = more.iter().copied().fold(0f32, f32::max);
            let bound = (0..more.len()).map(|pixel| missing(pixel, share)).fold(0f32, f32::max);
            eprintln!("negligible {share}: up to {most} of the mean irradiance more, they could hide {bound}");
            // The picture is one tile. Distant balls are about as wide as a texel.
            assert!(more.iter().all(|m| (-1e-4..1.5 * bound).contains(m)), "{more:?}");
            // Some balls are left out, and fewer with a smaller share.
            assert!(most > 0.1 * bound && most < last, "{most}");
            last = most;
        }
        // The shadow of the low sun is unchanged, because balls in front of the sun count.
        let shadow = |picture: &[Vec3]| picture.iter().map(|p| p.x).fold(f32::INFINITY, f32::min);
        let settings = Settings { negligible: 0.005, ..full.clone() };
        assert!(shadow(&studio.irradiance(&eye, &settings)) - shadow(&all) < 0.1 * mean);
    });
}

#[test]
fn colours_of_lights_are_hidden_apart() {
    with_gpu(|gpu| {
        // A red and a blue light over green radiance: the hidden light of one colour does not depend on the other
        // colours.
        let [red, blue] = [DVec3::new(0.6, 0.8, 0.1), DVec3::new(-0.5, 0.8, -0.3)].map(DVec3::normalize);
        let lit = |colours: Vec3| {
            fiv_lab::painted(128, |d| {
                let of = |towards: DVec3| if d.dot(towards) > 0.98 { 60.0 } else { 0.0 };
                Vec3::new(of(red), 1.0, of(blue)) * colours
            })
        };
        let view = flat_view(EYE, Vec3::ZERO, SIZE, [EXTENT; 2]);
        for shared in [Shared::Lights, Shared::Filled] {
            let settings = settings(shared);
            let shaded = |colours: Vec3| {
                let scene = stage(lit(colours), &places(40));
                Studio::new(gpu, &scene, &settings, None).irradiance(&view, &settings)
            };
            let open = twin::irradiance(&Sky::new(Some(&lit(Vec3::ONE)), 16).unwrap(), DVec3::Y).as_vec3();
            let both = shaded(Vec3::ONE);
            let [reds, blues] = [vec3(1.0, 1.0, 0.0), vec3(0.0, 1.0, 1.0)].map(shaded);
            for (i, both) in both.iter().enumerate() {
                // The order of summation differs, and each bright part gets its share of green.
                let off = |colour: usize, alone: f32| (both[colour] - alone).abs() / open[colour];
                assert!(off(0, reds[i].x) < 1e-4 && off(2, blues[i].z) < 1e-4, "{shared:?} {i}: {both} {}", blues[i]);
            }
            let apart = |a: usize, b: usize| both.iter().any(|e| e[a] < 0.3 * open[a] && e[b] > 0.7 * open[b]);
            assert!(apart(0, 2) && apart(2, 0), "{shared:?}: both colours have the same shadow");
        }
    });
}
