//! Brute force, the reference for irradiance vectors, against the path tracer, with which it shares only the rays:
//! direct light of an environment on diffuse surfaces.

use crate::fiv_lab::{Studio, nrmse, painted};
use crate::tracer_lab;
use glam::Vec3;
use lucerna::{
    gpu::testing::with_gpu,
    scene::{Environment, Pose, Scene, View, ground},
    techniques::fiv::{Method, Settings, Shared},
    tracer::Tracer,
};
use lucerna_scenes as builtin;

/// Smooth coloured radiance with a sun of 20 degrees, which 32 texels resolve.
fn light() -> Environment {
    painted(256, |d| {
        let sun = (40.0 * (d.dot(glam::DVec3::new(0.5, 0.7, -0.4).normalize()) - 1.0)).exp();
        Vec3::new((0.4 + 0.3 * d.x + 9.0 * sun) as f32, (0.5 + 0.4 * d.y + 8.0 * sun) as f32, (0.6 + 5.0 * sun) as f32)
    })
}

fn stage() -> Scene {
    let things = ["queen", "hare"].map(|name| builtin::load(name).unwrap());
    let mut scene = ground::on_ground(&things, &ground::Ground::default()).unwrap();
    scene.environment = Some(light());
    scene
}

fn view_of(scene: &Scene, name: &str, extent: [u32; 2]) -> View {
    let camera = scene.cameras.iter().position(|c| c.name == name).unwrap();
    let node = scene.nodes.iter().position(|n| n.camera == Some(camera as u32)).unwrap();
    View::new(&scene.cameras[camera], Pose::rest(scene).world[node], extent)
}

#[test]
fn brute_force_and_path_tracer_agree_on_direct_light() {
    with_gpu(|gpu| {
        let scene = stage();
        let pose = Pose::rest(&scene);
        let settings = Settings { size: 32, method: Method::BruteForce, ..Settings::default() };
        let mut tracer = Tracer::new(gpu, &scene, &pose).unwrap();
        let mut studio = Studio::new(gpu, &scene, &settings, None);
        for name in ["ground", "front"] {
            let view = view_of(&scene, name, [24, 24]);
            let found = studio.shot(&pose, &view, &settings).1;
            tracer.start(&view, &tracer_lab::matt(0)).unwrap();
            tracer.run(768, |_| true).unwrap();
            let layers = tracer.layers().unwrap();
            let traced: Vec<Vec3> =
                layers.layer("direct").unwrap().rgb_pixels().unwrap().into_iter().map(Vec3::from).collect();
            // The background is not direct light of a surface.
            let both: Vec<(Vec3, Vec3)> =
                traced.into_iter().zip(found).filter(|(t, _)| t.max_element() > 0.0).collect();
            assert!(both.len() > 200, "{name}: {} pixels", both.len());
            let (truth, found): (Vec<Vec3>, Vec<Vec3>) = both.into_iter().unzip();
            let mean = |p: &[Vec3]| p.iter().copied().sum::<Vec3>() / p.len() as f32;
            let (energy, error) = (mean(&found) / mean(&truth), nrmse(&truth, &found));
            eprintln!("{name}: energy {energy}, NRMSE {error:.4}");
            assert!((energy - 1.0).abs().max_element() < 0.01, "{name}: energy {energy}");
            // The path tracer's noise with so many paths is 0.02.
            assert!(error < 0.03, "{name}: NRMSE {error}");
        }
    });
}

#[test]
fn the_ground_alone_is_seen_from_above() {
    with_gpu(|gpu| {
        let scene = stage();
        let settings = Settings { method: Method::Unshadowed, ..Settings::default() };
        let view = view_of(&scene, "ground", [32, 32]);
        let irradiance = Studio::new(gpu, &scene, &settings, None).irradiance(&view, &settings);
        // A plane has one normal, and no occluder hides any light.
        let first = irradiance[0];
        assert!(first.min_element() > 0.0 && irradiance.iter().all(|e| (*e - first).length() < 1e-5 * first.length()));
    });
}

#[test]
fn what_thin_bodies_share_is_less_than_what_their_discs_share() {
    with_gpu(|gpu| {
        let queen = [builtin::load("queen").unwrap()];
        let close = ground::Ground { copies: 3, gap: 0.2, ..Default::default() };
        let mut scene = ground::on_ground(&queen, &close).unwrap();
        scene.environment = Some(builtin::environment("area").unwrap());
        let view = view_of(&scene, "ground", [32, 32]);
        let base = Settings { size: 16, azimuths: 32, polars: 17, radii: 15, ..Settings::default() };
        let truth = Settings { method: Method::BruteForce, ..base.clone() };
        let reference = Studio::new(gpu, &scene, &truth, None).irradiance(&view, &truth);
        // The vectors are the same for all of them.
        let mut studio = Studio::new(gpu, &scene, &base, None);
        let mut error = |settings: &Settings| {
            let found = studio.irradiance(&view, settings);
            // Ground below the queens is never visible.
            let seen = reference.iter().zip(found).filter(|(r, _)| r.min_element() > 0.0);
            let (r, f): (Vec<Vec3>, Vec<Vec3>) = seen.map(|(r, f)| (*r, f)).unzip();
            nrmse(&r, &f)
        };
        let discs = error(&Settings { shared: Shared::Discs, ..base.clone() });
        let filled = error(&Settings { shared: Shared::Filled, ..base.clone() });
        let (lights, off) = (error(&base), error(&Settings { overlap: false, ..base.clone() }));
        eprintln!(
            "NRMSE of three queens: lights {lights:.4}, filled {filled:.4}, discs {discs:.4}, without correction {off:.4}"
        );
        assert!(lights < 0.8 * discs && lights < 1.05 * off);
        assert!(filled < 0.8 * discs && filled < 1.05 * off);
    });
}
