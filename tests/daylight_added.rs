//! Objects that are added to baked daylight at run time: their light by probes and by the paper's screen texels.

use std::sync::Arc;

use crate::{
    daylight_probes::{baking, day, eye, room, stored, sunny},
    tracer_lab::{Stage, render},
};
use glam::{Vec2, Vec3, vec3};
use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    graph::{Graph, Runner},
    image::Layers,
    scene::{
        Environment, Material, Pose, Scene,
        added::{Standing, add},
        environment::direction_from_uv,
    },
    technique::{Ready, Shot, Technique},
    techniques::daylight::{Added, Baked, Baking, Daylight, PictureSettings, Sky, Stored, Weather, probes::Grid},
    tracer::{Filter, Settings},
};

/// A picture of baked daylight at nine o'clock.
fn picture(gpu: &Gpu, scene: &Scene, stored: &Arc<Stored>, added: Added) -> lucerna::Result<Layers> {
    let mut settings = PictureSettings::default();
    settings.daylight.time = "09:00".into();
    settings.daylight.added = added;
    picture_by(gpu, scene, stored, &settings)
}

pub fn picture_by(
    gpu: &Gpu,
    scene: &Scene,
    stored: &Arc<Stored>,
    settings: &PictureSettings,
) -> lucerna::Result<Layers> {
    let baked = Baked { stored: stored.clone(), frames: None, stream: None, file: None, digest: None };
    let mut ready = Ready::<Daylight>::new(gpu, scene, settings, Some(&baked), &mut |_, _| true)?;
    let mut graph = Graph::new(Daylight::NAME);
    let picture = ready.frame(&mut graph, (scene, &Pose::rest(scene)), &eye(), Shot::default(), settings)?;
    let reading = picture.read(&mut graph, true, false);
    let frame = Runner::new(gpu).run(&graph)?;
    Ok(reading.layers(&frame))
}

/// The scene under the sun and the sky of nine o'clock.
fn relit(scene: &Scene) -> Scene {
    let sun = Vec3::from(day().sun(9.0 * 3600.0).direction(0.0));
    let sky = Sky::new(Weather::default(), sun.as_dvec3().to_array()).unwrap();
    let mut scene = sunny(scene.clone(), sun, Vec3::from(sky.sun_irradiance()));
    let (width, height) = (256, 128);
    let texel = |i: u32| {
        let uv = Vec2::new((i % width) as f32 + 0.5, (i / width) as f32 + 0.5) / Vec2::new(width as f32, height as f32);
        Vec3::from(sky.radiance(direction_from_uv(uv).to_array()))
    };
    let pixels = (0..width * height).map(texel).collect();
    scene.environment = Some(Environment { name: "sky".into(), width, height, pixels, rotation: 0.0, scale: 1.0 });
    scene
}

#[test]
fn an_added_object_has_the_indirect_light_of_the_path_tracer_by_probes() {
    with_gpu(|gpu| {
        let scene = room();
        let mut stage = Stage::new();
        let white = stage.material(Material::diffuse("white", Vec3::splat(0.7)));
        stage.sphere(white, Vec3::ZERO, 0.35, 24, false);
        let mut with = scene.clone();
        add(&mut with, stage.scene, &Standing { foot: vec3(0.9, 0.0, 0.9), scale: 1.0, turn: 0.0 }).unwrap();
        let grid = Grid { origin: [-1.6, 0.25, -1.6], spacing: [0.8, 0.5, 0.8], counts: [5, 4, 5] };
        let settings = Baking { probe_samples: 256, bounces: 8, ..baking() };
        let stored = Arc::new(stored(gpu, &scene, Some(grid), settings));
        // Pixels at which the object is seen: where the scene without it has another depth.
        let alone = picture(gpu, &scene, &stored, Added::Probes).unwrap();
        let probes = picture(gpu, &with, &stored, Added::Probes).unwrap();
        let screen = picture(gpu, &with, &stored, Added::Screen).unwrap();
        let depth = |layers: &Layers| layers.layer("depth").unwrap().data.clone();
        let (before, after) = (depth(&alone), depth(&probes));
        let seen: Vec<usize> = (0..after.len()).filter(|i| (before[*i] - after[*i]).abs() > 1e-3 * after[*i]).collect();
        assert!(seen.len() > 25, "{} pixels", seen.len());
        let settings =
            Settings { bounces: 9, roulette: 16, diffuse_only: true, filter: Filter::Centre, ..Settings::default() };
        let truth = render(gpu, &relit(&with), &eye(), &settings, 256);
        let mean = |layers: &Layers, names: &[&str]| {
            let sum = |name: &&str| {
                let data = &layers.layer(name).unwrap().data;
                seen.iter().map(|pixel| f64::from(data[3 * pixel + 1])).sum::<f64>() / seen.len() as f64
            };
            names.iter().map(sum).sum::<f64>()
        };
        // In the tracer's layers the light of the sky is direct; shadow maps and rays agree about the sun elsewhere.
        let sun_alone = render(gpu, &Scene { environment: None, ..relit(&with) }, &eye(), &settings, 64);
        let wanted = mean(&truth, &["direct", "indirect"]) - mean(&sun_alone, &["direct"]);
        let (by_probes, by_screen) = (mean(&probes, &["indirect"]), mean(&screen, &["indirect"]));
        eprintln!("indirect light of the object: {wanted:.3}, by probes {by_probes:.3}, by the screen {by_screen:.3}");
        assert!((by_probes / wanted - 1.0).abs() < 0.1, "{by_probes}, not {wanted}");
        // The light of all other pixels is the baked one, exactly.
        let of = |layers: &Layers| layers.layer("indirect").unwrap().data.clone();
        let (a, b, c) = (of(&alone), of(&probes), of(&screen));
        for pixel in (0..after.len()).filter(|i| !seen.contains(i)) {
            for channel in 3 * pixel..3 * pixel + 3 {
                assert!(a[channel] == b[channel] && a[channel] == c[channel], "pixel {pixel}");
            }
        }
        let irradiance = |layers: &Layers| layers.layer("irradiance").unwrap().data.clone();
        // By the screen, the object has the irradiance of what is behind it.
        let (behind, front) = (irradiance(&alone), irradiance(&screen));
        assert!(seen.iter().all(|pixel| front[3 * pixel] == behind[3 * pixel]));
    });
}

#[test]
fn a_bake_without_probes_says_so_and_a_bake_of_another_scene_is_refused() {
    with_gpu(|gpu| {
        let scene = room();
        let mut with = scene.clone();
        let standing = Standing { foot: vec3(0.5, 0.0, 0.5), scale: 0.5, turn: 0.0 };
        add(&mut with, lucerna_scenes::load("hare").unwrap(), &standing).unwrap();
        let stored = Arc::new(stored(gpu, &scene, None, Baking { samples: 2, bounces: 1, ..baking() }));
        assert!(stored.probe_summary().is_none());
        let error = picture(gpu, &with, &stored, Added::Probes).unwrap_err();
        assert!(error.exit_code() == 3 && error.to_string().contains("no probes"), "{error}");
        picture(gpu, &with, &stored, Added::Screen).unwrap();
        picture(gpu, &scene, &stored, Added::Probes).unwrap();
        let mut other = lucerna_scenes::load("cornell").unwrap();
        add(&mut other, lucerna_scenes::load("hare").unwrap(), &standing).unwrap();
        let error = picture(gpu, &other, &stored, Added::Screen).unwrap_err();
        assert!(error.exit_code() == 3 && error.to_string().contains("geometry"), "{error}");
    });
}
