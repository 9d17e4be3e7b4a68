//! What must not change a picture, or change it in a known way: light twice as bright, colours exchanged, how samples are
//! drawn, how the work is cut; and how fast the error falls.

mod tracer_lab;

use glam::{Vec3, vec3};
use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    image::Layers,
    reference::tracer::{Filter, Settings, Sources, State, Strategy, Tracer},
    scene::{Environment, Material, Pose, Scene, View},
};
use tracer_lab::{Stage, luminance, matt, mean, render, view};

/// Something of everything: a glossy floor, a coloured box, a ball of glass, a mirror; a lamp, a point light, a sky.
fn mixed() -> (Scene, View) {
    let mut stage = Stage::new();
    let floor = Material { roughness: 0.35, metallic: 0.3, ..Material::diffuse("floor", vec3(0.7, 0.6, 0.5)) };
    let floor = stage.material(floor);
    let red = stage.material(Material::diffuse("box", vec3(0.7, 0.2, 0.1)));
    let glass = stage.material(Material {
        transmission: 0.9,
        roughness: 0.1,
        ..Material::diffuse("glass", vec3(0.9, 1.0, 0.8))
    });
    let mirror =
        stage.material(Material { metallic: 1.0, roughness: 0.0, ..Material::diffuse("mirror", vec3(0.9, 0.8, 0.7)) });
    let lamp = stage.emitter(vec3(6.0, 5.0, 4.0));
    stage.quad(floor, vec3(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0);
    stage.quad(mirror, vec3(-2.0, 0.0, -2.0), Vec3::X * 4.0, Vec3::Y * 2.0);
    stage.cuboid(red, vec3(-1.0, 0.0, -1.0), vec3(-0.4, 0.8, -0.4), false);
    stage.sphere(glass, vec3(0.5, 0.5, 0.2), 0.4, 10, false);
    stage.quad(lamp, vec3(-0.6, 2.0, -0.3), Vec3::X * 0.9, Vec3::Z * 0.6);
    stage.point(vec3(1.5, 1.5, 1.0), vec3(2.0, 3.0, 1.0));
    let pixels = (0..32 * 16).map(|i| vec3(0.2, 0.3, 0.5) * (1.0 + (i % 5) as f32) / 4.0).collect();
    stage.scene.environment = Some(Environment { width: 32, height: 16, pixels, ..Environment::constant(Vec3::ONE) });
    (stage.scene, view(vec3(0.8, 1.6, 3.5), vec3(0.0, 0.5, 0.0), 45.0, [24, 20]))
}

fn settings() -> Settings {
    Settings { bounces: 3, roulette: 2, ..Settings::default() }
}

const LIGHT: [&str; 4] = ["", "direct", "indirect", "emission"];

fn data<'a>(layers: &'a Layers, name: &str) -> &'a [f32] {
    &layers.layer(name).unwrap().data
}

#[test]
fn twice_the_light_is_twice_the_picture_in_every_bit() {
    with_gpu(|gpu| {
        let (scene, view) = mixed();
        let mut bright = scene.clone();
        bright.materials.iter_mut().for_each(|m| m.emissive *= 2.0);
        bright.lights.iter_mut().for_each(|l| l.intensity *= 2.0);
        bright.environment.iter_mut().for_each(|e| e.scale *= 2.0);
        let (one, two) = (render(gpu, &scene, &view, &settings(), 6), render(gpu, &bright, &view, &settings(), 6));
        for name in LIGHT {
            let doubled: Vec<u32> = data(&one, name).iter().map(|v| (2.0 * v).to_bits()).collect();
            let found: Vec<u32> = data(&two, name).iter().map(|v| v.to_bits()).collect();
            assert!(doubled == found, "layer {name:?}");
        }
        let (indirect, emission) = (mean(&one, "indirect"), mean(&one, "emission"));
        assert!(indirect[0] > 0.002 && emission[2] > 0.01, "{indirect:?} {emission:?}");
    });
}

#[test]
fn exchanged_channels_exchange_the_picture_in_every_bit() {
    with_gpu(|gpu| {
        let (scene, view) = mixed();
        let turn = |c: Vec3| vec3(c.y, c.z, c.x);
        let mut turned = scene.clone();
        for m in &mut turned.materials {
            m.base_color = turn(m.base_color.truncate()).extend(m.base_color.w);
            m.emissive = turn(m.emissive);
        }
        turned.lights.iter_mut().for_each(|l| l.color = turn(l.color));
        turned.environment.iter_mut().flat_map(|e| &mut e.pixels).for_each(|p| *p = turn(*p));
        let (one, two) = (render(gpu, &scene, &view, &settings(), 6), render(gpu, &turned, &view, &settings(), 6));
        for name in LIGHT {
            let wanted: Vec<u32> =
                data(&one, name).chunks_exact(3).flat_map(|p| [p[1], p[2], p[0]]).map(f32::to_bits).collect();
            let found: Vec<u32> = data(&two, name).iter().map(|v| v.to_bits()).collect();
            assert!(wanted == found, "layer {name:?}");
        }
    });
}

/// Difference of two pictures' means in standard deviations.
fn z(a: &Layers, b: &Layers) -> f64 {
    let (sa, sb) = (tracer_lab::deviation(a), tracer_lab::deviation(b));
    (luminance(mean(a, "")) - luminance(mean(b, ""))).abs() / (sa * sa + sb * sb).sqrt()
}

#[test]
fn every_way_to_find_light_finds_the_same() {
    with_gpu(|gpu| {
        let (mut scene, view) = mixed();
        // A ball that shines, so that all ways meet something, and no needle of light that one of them misses.
        scene.materials[1].emissive = vec3(0.5, 0.4, 0.2);
        let base = Settings { bounces: 1, ..settings() };
        let with =
            |strategy, seed, samples| render(gpu, &scene, &view, &Settings { strategy, seed, ..base.clone() }, samples);
        let mis = with(Strategy::Mis, 1, 96);
        for (strategy, seed) in [(Strategy::Lights, 2), (Strategy::Bsdf, 3)] {
            let alone = with(strategy, seed, 192);
            assert!(z(&mis, &alone) < 4.0, "{strategy:?}: {} deviations", z(&mis, &alone));
        }
        // Pixel by pixel: the differences are as large as the variances say, once there are enough samples to know those of
        // rays that rarely meet a lamp.
        let other = with(Strategy::Bsdf, 4, 768);
        let variances = data(&mis, "variance").iter().zip(data(&other, "variance"));
        let lum = |p: &[f32]| luminance([0, 1, 2].map(|c| f64::from(p[c])));
        let pixels = data(&mis, "").chunks_exact(3).zip(data(&other, "").chunks_exact(3));
        let squares: Vec<f64> = pixels
            .zip(variances)
            .filter(|(_, (a, b))| **a > 1e-9 && **b > 1e-9)
            .map(|((p, q), (a, b))| (lum(p) - lum(q)).powi(2) / f64::from(a + b))
            .collect();
        let ratio = squares.iter().sum::<f64>() / squares.len() as f64;
        assert!((0.6..1.6).contains(&ratio), "mean square of z is {ratio}");
    });
}

#[test]
fn sources_add_up_to_the_whole() {
    with_gpu(|gpu| {
        let (scene, view) = mixed();
        let of = |sources, seed| {
            let layers = render(gpu, &scene, &view, &Settings { sources, seed, ..settings() }, 96);
            (luminance(mean(&layers, "")), tracer_lab::deviation(&layers))
        };
        let (whole, s) = of(Sources::All, 1);
        let parts =
            [(Sources::Punctual, 2), (Sources::Emissive, 3), (Sources::Environment, 4)].map(|(p, seed)| of(p, seed));
        let sum: f64 = parts.iter().map(|p| p.0).sum();
        let sigma = (parts.iter().map(|p| p.1 * p.1).sum::<f64>() + s * s).sqrt();
        assert!((sum - whole).abs() < 4.0 * sigma, "{sum} instead of {whole} ± {sigma}");
        assert!(parts.iter().all(|p| p.0 > 0.01 * whole));
    });
}

fn bits(layers: &Layers) -> Vec<u32> {
    layers.layers.iter().flat_map(|l| &l.data).map(|v| v.to_bits()).collect()
}

fn traced(gpu: &Gpu, scene: &Scene, view: &View, work: impl FnOnce(&mut Tracer<'_>)) -> Vec<u32> {
    let mut tracer = Tracer::new(gpu, scene, &Pose::rest(scene)).unwrap();
    tracer.start(view, &settings()).unwrap();
    work(&mut tracer);
    assert_eq!(tracer.progress().unwrap().samples, 5.0);
    bits(&tracer.layers().unwrap())
}

#[test]
fn the_bits_do_not_depend_on_tiles_or_on_breaks() {
    with_gpu(|gpu| {
        let (scene, view) = mixed();
        let whole = traced(gpu, &scene, &view, |t| t.step(5).unwrap());
        for slots in [64, 448, 1000] {
            let cut = traced(gpu, &scene, &view, |t| {
                t.set_tile(Some(slots));
                t.step(5).unwrap();
            });
            assert!(whole == cut, "tiles of {slots} slots");
        }
        let steps = traced(gpu, &scene, &view, |t| [1, 3, 1].iter().for_each(|&n| t.step(n).unwrap()));
        assert!(whole == steps, "in steps");
        // Stopped in the middle of a sample, saved, and gone on with in another tracer.
        let about = serde_json::json!({ "scene": 1 });
        let mut first = Tracer::new(gpu, &scene, &Pose::rest(&scene)).unwrap();
        first.start(&view, &settings()).unwrap();
        first.set_tile(Some(192));
        let mut tiles = 0;
        first
            .run(5, |_| {
                tiles += 1;
                tiles < 7
            })
            .unwrap();
        assert!(first.progress().unwrap().samples.fract() > 0.0);
        let bytes = first.save(&about).unwrap().encode().unwrap();
        let state = State::decode(&bytes).unwrap();
        let resumed = traced(gpu, &scene, &view, |t| {
            t.restore(&state, &about).unwrap();
            t.run(5, |_| true).unwrap();
        });
        assert!(whole == resumed, "resumed");
        // A state of something else is refused, and the message says why.
        let mut other = Tracer::new(gpu, &scene, &Pose::rest(&scene)).unwrap();
        other.start(&view, &Settings { bounces: 7, ..settings() }).unwrap();
        let error = other.restore(&state, &serde_json::json!({ "scene": 2 })).unwrap_err();
        assert_eq!(error.exit_code(), 3);
        let text = error.to_string();
        assert!(text.contains("settings.bounces was 3, now is 7") && text.contains("scene was 1, now is 2"), "{text}");
    });
}

#[test]
fn the_error_falls_as_one_over_the_samples() {
    with_gpu(|gpu| {
        let mut stage = Stage::new();
        let (floor, lamp) =
            (stage.material(Material::diffuse("floor", Vec3::splat(0.8))), stage.emitter(Vec3::splat(4.0)));
        stage.quad(floor, vec3(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0);
        stage.quad(lamp, vec3(-0.5, 1.0, -0.5), Vec3::X, Vec3::Z);
        let seen = view(vec3(0.0, 0.9, 1.8), Vec3::ZERO, 60.0, [32, 32]);
        let settings = |seed| Settings { seed, filter: Filter::Centre, ..matt(0) };
        let reference = render(gpu, &stage.scene, &seen, &settings(99), 4096);
        let counts = [4u32, 16, 64, 256];
        let errors: Vec<f64> = counts
            .iter()
            .map(|&n| {
                let picture = render(gpu, &stage.scene, &seen, &settings(n), n);
                let pairs = data(&picture, "").iter().zip(data(&reference, ""));
                pairs.map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>() / data(&picture, "").len() as f64
            })
            .collect();
        let x: Vec<f64> = counts.iter().map(|&n| f64::from(n).ln()).collect();
        let y: Vec<f64> = errors.iter().map(|e| e.ln()).collect();
        let (mx, my) = (x.iter().sum::<f64>() / 4.0, y.iter().sum::<f64>() / 4.0);
        let slope = x.iter().zip(&y).map(|(x, y)| (x - mx) * (y - my)).sum::<f64>()
            / x.iter().map(|x| (x - mx).powi(2)).sum::<f64>();
        assert!((slope + 1.0).abs() < 0.12, "slope {slope}, errors {errors:?}");
    });
}

#[test]
fn settings_out_of_range_are_refused() {
    with_gpu(|gpu| {
        let (scene, view) = mixed();
        let mut tracer = Tracer::new(gpu, &scene, &Pose::rest(&scene)).unwrap();
        assert_eq!(tracer.layers().unwrap_err().exit_code(), 2);
        let error = tracer.start(&view, &Settings { bounces: 1001, ..settings() }).unwrap_err();
        assert!(error.exit_code() == 2 && error.to_string().contains("bounces"), "{error}");
    });
}
