//! Occluders that the receiver's plane cuts, and separated texels, against brute force.

use crate::fiv_lab::{Studio, ball, ground, nrmse, painted, thing};
use crate::tracer_lab::flat_view;
use glam::{DVec3, Mat4, Vec3, vec3};
use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    resident::Resident,
    scene::{Environment, Pose, Scene, View},
    techniques::fiv::{Cut, Fiv, Method, Settings, Sky, sky},
};

fn base() -> Settings {
    Settings { size: 16, azimuths: 24, polars: 13, radii: 12, ..Settings::default() }
}

/// Balls of radius 0.5 on a ground.
fn stage(environment: Environment, balls: &[Vec3]) -> Scene {
    let mut scene = Scene { environment: Some(environment), ..Scene::default() };
    ground(&mut scene, 20.0);
    for (i, at) in balls.iter().enumerate() {
        let (positions, indices) = ball(0.5, 16);
        thing(&mut scene, &format!("ball {i}"), positions, indices, Mat4::from_translation(*at));
    }
    scene
}

fn picture(gpu: &Gpu, scene: &Scene, view: &View, settings: &Settings) -> Vec<Vec3> {
    Studio::new(gpu, scene, settings, None).irradiance(view, settings)
}

fn truth(settings: &Settings) -> Settings {
    Settings { method: Method::BruteForce, ..settings.clone() }
}

#[test]
fn what_lies_behind_the_plane_is_known_by_the_light_from_there() {
    with_gpu(|gpu| {
        let even = painted(64, |_| Vec3::ONE);
        let bright_below = painted(64, |d| Vec3::splat((1.2 - d.y) as f32));
        let lamp = DVec3::new(-0.8, 0.75, -0.2).normalize();
        let from_above = painted(128, |d| if d.dot(lamp) > 0.95 { Vec3::splat(9.0) } else { Vec3::ZERO });
        for (name, environment) in [("even", even), ("bright below", bright_below), ("from above", from_above)] {
            for height in [0.2, -0.15] {
                let scene = stage(environment.clone(), &[vec3(0.0, height, 0.0)]);
                // The pixel lies beside the ball on the side of its shadow.
                let view = flat_view(vec3(1.3, 2.0, 0.2), vec3(1.3, 0.0, 0.2), 0.7, [12, 12]);
                let few = base();
                let reference = picture(gpu, &scene, &view, &truth(&few));
                let mut studio = Studio::new(gpu, &scene, &few, None);
                let mut error = |settings: &Settings| {
                    let found = studio.irradiance(&view, settings);
                    let squares = reference.iter().zip(&found).map(|(r, f)| (*r - *f).length_squared()).sum::<f32>();
                    (squares / reference.iter().map(|r| r.length_squared()).sum::<f32>()).sqrt()
                };
                let light = error(&few);
                let by_height = error(&Settings { cut: Cut::Height, ..few.clone() });
                let off = error(&Settings { partial: false, ..few.clone() });
                eprintln!("{name}, centre at {height}: {light:.4}, by height {by_height:.4}, without {off:.4}");
                // The set has few samples, so a weak shadow may be off by a hundredth of the light.
                assert!(light < 0.05 && light < 1.05 * off + 1e-2, "{name} {height}");
                // Light from above alone needs no correction.
                assert!(name == "from above" || (light < 0.7 * by_height && light < 0.9 * off), "{name} {height}");
            }
        }
    });
}

/// A grey sky with a sun of one pixel.
fn sunny() -> Environment {
    let to = DVec3::new(0.4, 0.8, -0.3).normalize();
    painted(256, |d| Vec3::splat(if d.dot(to) > 0.9995 { 4000.0 } else { 0.4 + 0.3 * d.y as f32 }))
}

#[test]
fn lights_kept_apart_are_all_light_together_with_the_rest() {
    let whole = Sky::new(Some(&sunny()), 16).unwrap();
    assert_eq!(whole.clone().apart(0), whole);
    let split = whole.clone().apart(4);
    assert!((1..=4).contains(&split.suns.len()) && split.hash() != whole.hash());
    let mut again = split.clone();
    for sun in again.suns.drain(..) {
        assert_eq!(again.radiance[sun.texel as usize], Vec3::ZERO);
        again.radiance[sun.texel as usize] = sun.radiance;
    }
    assert_eq!(again, whole);
    // The first separated texel is the brightest, which contains the sun.
    let (face, x, y) = sky::place(16, split.suns[0].texel);
    let st = (glam::DVec2::new(x.into(), y.into()) + 0.5) / 16.0;
    assert!(sky::direction(face, st).normalize().dot(DVec3::new(0.4, 0.8, -0.3).normalize()) > 0.99);
    // Constant radiance has no texel to separate.
    assert!(Sky::new(Some(&Environment::constant(Vec3::ONE)), 16).unwrap().apart(16).suns.is_empty());
}

#[test]
fn suns_have_hard_shadows_which_overlap_once() {
    with_gpu(|gpu| {
        let apart = Settings { suns: 4, ..base() };
        // Two balls one behind the other as seen from the sun, and one ball beside them.
        let toward = vec3(0.4, 0.8, -0.3);
        for balls in [vec![vec3(0.0, 0.7, 0.0)], vec![vec3(0.0, 0.7, 0.0), toward * 1.6 + vec3(0.0, 0.6, 0.0), Vec3::Y]]
        {
            let scene = stage(sunny(), &balls);
            let view = flat_view(vec3(-0.4, 0.15, 0.3), vec3(-0.4, 0.0, 0.3), 1.6, [32, 32]);
            let reference = picture(gpu, &scene, &view, &truth(&base()));
            let error = |settings: &Settings| nrmse(&reference, &picture(gpu, &scene, &view, settings));
            let (without, with) = (error(&base()), error(&apart));
            eprintln!("NRMSE of {} balls under a sun: {without:.4}, separated {with:.4}", balls.len());
            assert!(with < 0.03 && with < 0.4 * without);
        }
        // The shadow of a ball on itself: exactly the half that faces away from the sun is dark.
        let scene = stage(sunny(), &[vec3(0.0, 0.7, 0.0)]);
        let view = flat_view(vec3(1.5, 2.5, 0.5), vec3(0.0, 0.7, 0.0), 0.45, [32, 32]);
        let reference = picture(gpu, &scene, &view, &truth(&base()));
        let (without, with) = (
            nrmse(&reference, &picture(gpu, &scene, &view, &base())),
            nrmse(&reference, &picture(gpu, &scene, &view, &apart)),
        );
        eprintln!("NRMSE on the ball: {without:.4}, separated {with:.4}");
        assert!(with < 0.03 && with < 1.2 * without);
        // Without occluders no light is lost.
        let empty = stage(sunny(), &[]);
        let view = flat_view(Vec3::Y, Vec3::ZERO, 0.5, [2, 2]);
        let (open, found) = (picture(gpu, &empty, &view, &truth(&base()))[0], picture(gpu, &empty, &view, &apart)[0]);
        assert!((open - found).length() < 5e-3 * open.length(), "{found} instead of {open}");
    });
}

/// A box between two corners, wound outwards.
fn cuboid(positions: &mut Vec<Vec3>, indices: &mut Vec<u32>, low: Vec3, high: Vec3) {
    let first = positions.len() as u32;
    positions.extend((0..8).map(|i| {
        let pick = |bit: u32, low: f32, high: f32| if i >> bit & 1 == 0 { low } else { high };
        vec3(pick(0, low.x, high.x), pick(1, low.y, high.y), pick(2, low.z, high.z))
    }));
    for [a, b, c, d] in [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]] {
        indices.extend([a, b, c, a, c, d].map(|i| i + first));
    }
}

#[test]
fn a_sun_casts_the_shadow_of_a_body_that_is_different_from_all_sides() {
    with_gpu(|gpu| {
        // A post on the ground with an arm: much of the shadow lies within the bounding sphere.
        let mut scene = Scene { environment: Some(sunny()), ..Scene::default() };
        ground(&mut scene, 20.0);
        let (mut positions, mut indices) = (vec![], vec![]);
        cuboid(&mut positions, &mut indices, vec3(-0.1, 0.002, -0.1), vec3(0.1, 1.0, 0.1));
        cuboid(&mut positions, &mut indices, vec3(0.1, 0.7, -0.1), vec3(0.9, 1.0, 0.1));
        thing(&mut scene, "gallows", positions, indices, Mat4::IDENTITY);
        let view = flat_view(vec3(0.0, 0.001, 0.2), vec3(0.0, 0.0, 0.2), 2.4, [40, 40]);
        let reference = picture(gpu, &scene, &view, &truth(&base()));
        let error = |settings: &Settings| nrmse(&reference, &picture(gpu, &scene, &view, settings));
        let (without, with) = (error(&base()), error(&Settings { suns: 4, ..base() }));
        eprintln!("NRMSE below a post with an arm: {without:.4}, separated {with:.4}");
        assert!(with < 0.03 && with < 0.5 * without, "{with} {without}");
    });
}

#[test]
fn suns_move_with_occluders_and_are_refused_for_those_that_turn() {
    with_gpu(|gpu| {
        let apart = Settings { suns: 4, ..base() };
        let scene = stage(sunny(), &[vec3(0.0, 0.7, 0.0)]);
        let view = flat_view(vec3(0.0, 0.15, 0.0), Vec3::ZERO, 1.5, [24, 24]);
        let mut pose = Pose::rest(&scene);
        pose.world[1].w_axis.x += 0.7;
        let moved = Studio::new(gpu, &scene, &apart, None).shot(&pose, &view, &apart).0;
        let there = picture(gpu, &stage(sunny(), &[vec3(0.7, 0.7, 0.0)]), &view, &apart);
        for (a, b) in moved.iter().zip(&there) {
            assert!((*a - *b).length() < 1e-4 * b.length().max(1.0), "{a} {b}");
        }
        let settings = Settings { turns: 4, ..apart };
        let resident = Resident::new(gpu, &scene).unwrap();
        let error = Fiv::new(gpu, &scene, &resident, &settings, None, |_, _| true).unwrap_err();
        assert!(error.exit_code() == 2 && error.to_string().contains("fiv.suns"), "{error}");
    });
}
