//! Lamps that light objects that were added at run time: energy against the path tracer, shadows, and lamps that are off.

use std::sync::Arc;

use crate::{
    daylight_added::picture_by,
    daylight_probes::{baking, eye, plan, room, stored_of},
    tracer_lab::{Stage, render},
};
use glam::{Mat4, Vec3, vec3};
use lucerna::{
    gpu::testing::with_gpu,
    image::Layers,
    scene::{
        LightKind, Material, Scene,
        added::{Standing, add},
    },
    techniques::daylight::{Baking, Group, PictureSettings, Plan, Stored, probes::Grid},
    tracer::{Filter, Settings},
};

/// Where the object stands.
const FOOT: Vec3 = vec3(0.9, 0.0, 0.9);

/// The room with a lamp of each kind, and their groups.
fn lit() -> (Scene, Vec<Group>) {
    let mut stage = Stage { scene: room() };
    stage.point(vec3(0.2, 1.6, 1.4), vec3(3.0, 2.0, 1.0));
    let spot = LightKind::Spot { range: None, inner: 0.3, outer: 0.6 };
    // Spots shine along -Z of their node; this one shines down on the object.
    let down = Mat4::from_translation(FOOT + Vec3::Y * 2.0) * Mat4::from_rotation_x(-std::f32::consts::FRAC_PI_2);
    stage.light(spot, vec3(0.5, 1.0, 2.0), 2.0, down);
    let glowing = stage.emitter(vec3(1.0, 4.0, 2.0));
    stage.quad(glowing, vec3(1.3, 1.8, -0.4), Vec3::X * 0.5, Vec3::Z * 0.5);
    let group = |name: &str, lights: &[u32], materials: &[u32]| Group {
        name: name.into(),
        lights: lights.into(),
        materials: materials.into(),
    };
    let groups = vec![group("point", &[0], &[]), group("spot", &[1], &[]), group("panel", &[], &[glowing])];
    (stage.scene, groups)
}

fn with_object(scene: &Scene) -> Scene {
    let mut stage = Stage::new();
    let white = stage.material(Material::diffuse("white", Vec3::splat(0.7)));
    stage.sphere(white, Vec3::ZERO, 0.35, 24, false);
    let mut with = scene.clone();
    add(&mut with, stage.scene, &Standing { foot: FOOT, scale: 1.0, turn: 0.0 }).unwrap();
    with
}

fn grid() -> Grid {
    Grid { origin: [-1.6, 0.25, -1.6], spacing: [0.8, 0.5, 0.8], counts: [5, 4, 5] }
}

fn settings(lamps: &str, time: &str) -> PictureSettings {
    let mut settings = PictureSettings::default();
    settings.daylight.time = time.into();
    settings.daylight.lamps = lamps.into();
    settings.daylight.gloss = false;
    settings
}

fn of(layers: &Layers, name: &str) -> Vec<f32> {
    layers.layer(name).unwrap().data.clone()
}

/// Pixels at which two pictures have different depths.
fn different(a: &Layers, b: &Layers) -> Vec<usize> {
    let (a, b) = (of(a, "depth"), of(b, "depth"));
    (0..a.len()).filter(|i| (a[*i] - b[*i]).abs() > 1e-3 * b[*i]).collect()
}

#[test]
fn an_added_object_has_the_light_of_lamps_of_the_path_tracer() {
    with_gpu(|gpu| {
        let (scene, lamps) = lit();
        let with = with_object(&scene);
        let wanted = Plan { lamps: lamps.clone(), ..plan(&scene, grid(), Baking { bounces: 8, ..baking() }) };
        let stored = Arc::new(stored_of(gpu, &scene, wanted));
        let tracer =
            Settings { bounces: 9, roulette: 16, diffuse_only: true, filter: Filter::Centre, ..Settings::default() };
        let alone = picture_by(gpu, &scene, &stored, &settings("on", "23:00")).unwrap();
        for (number, group) in lamps.iter().enumerate() {
            let night = settings(&format!("off,{}=on", group.name), "23:00");
            let picture = picture_by(gpu, &with, &stored, &night).unwrap();
            let seen = different(&alone, &picture);
            assert!(seen.len() > 25, "{} pixels", seen.len());
            // The same lamps alone for the path tracer.
            let mut dark = with.clone();
            let others = (0..lamps.len()).filter(|other| *other != number);
            for other in others.map(|other| &lamps[other]) {
                other.lights.iter().for_each(|light| dark.lights[*light as usize].intensity = 0.0);
                other.materials.iter().for_each(|material| dark.materials[*material as usize].emissive = Vec3::ZERO);
            }
            let truth = render(gpu, &dark, &eye(), &tracer, 512);
            let mean = |layers: &Layers, names: &[&str], channel: usize| {
                let sum = |name: &&str| {
                    let data = of(layers, name);
                    seen.iter().map(|pixel| f64::from(data[3 * pixel + channel])).sum::<f64>() / seen.len() as f64
                };
                names.iter().map(sum).sum::<f64>()
            };
            for channel in 0..3 {
                let [found, wanted] = [&picture, &truth].map(|layers| mean(layers, &["direct", "indirect"], channel));
                let [direct, indirect] = ["direct", "indirect"]
                    .map(|name| [mean(&picture, &[name], channel), mean(&truth, &[name], channel)]);
                eprintln!(
                    "{}, channel {channel}: {:.3} of the path tracer; direct {direct:.4?}, indirect {indirect:.4?}",
                    group.name,
                    found / wanted
                );
                assert!((found / wanted - 1.0).abs() < 0.1, "{}, channel {channel}: {found}, not {wanted}", group.name);
            }
            // Other pixels have the baked light alone.
            let plain = picture_by(gpu, &scene, &stored, &night).unwrap();
            let (a, b) = (of(&plain, "direct"), of(&picture, "direct"));
            let rest = (0..a.len() / 3).filter(|pixel| !seen.contains(pixel));
            assert!(rest.flat_map(|pixel| 3 * pixel..3 * pixel + 3).all(|i| a[i] == b[i]));
        }
    });
}

#[test]
fn lamps_that_are_off_leave_the_bits_of_a_bake_without_lamps() {
    with_gpu(|gpu| {
        let (scene, mut lamps) = lit();
        lamps.truncate(2);
        let with = with_object(&scene);
        // The filter compares the light of lamps, too.
        let few = Baking { samples: 8, probe_samples: 16, bounces: 3, filter: 0, ..baking() };
        let baked = |lamps: Vec<Group>| -> Arc<Stored> {
            Arc::new(stored_of(gpu, &scene, Plan { lamps, ..plan(&scene, grid(), few.clone()) }))
        };
        let [with_lamps, without] = [baked(lamps), baked(Vec::new())];
        for (a, b) in with_lamps.probes.iter().zip(&without.probes) {
            assert!(a.positions == b.positions && a.light.sun == b.light.sun && a.light.sky == b.light.sky);
            assert!(a.light.lamps.images() > 0 && b.light.lamps.images() == 0);
        }
        let [a, b, c] = [(&with_lamps, "off"), (&without, ""), (&with_lamps, "on")]
            .map(|(stored, lamps)| picture_by(gpu, &with, stored, &settings(lamps, "09:00")).unwrap());
        for layer in ["", "direct", "indirect", "irradiance"] {
            assert!(of(&a, layer) == of(&b, layer), "layer `{layer}`");
            assert!(of(&a, layer) != of(&c, layer), "layer `{layer}`");
        }
        let summaries = [&with_lamps, &without].map(|stored| stored.probe_summary().unwrap());
        assert!(summaries[0].bytes > summaries[1].bytes);
    });
}
