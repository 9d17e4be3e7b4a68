//! What must not change a picture, or change it in a known way: light twice as bright, colours exchanged, how samples are
//! drawn, how the work is cut; and how fast the error falls.

use crate::tracer_lab;
use crate::tracer_lab::{Stage, luminance, matt, mean, render, view};
use glam::{Mat4, Vec3, vec3};
use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    image::Layers,
    scene::{AlphaMode, Environment, LightKind, Material, Pose, Scene, View},
    tracer::{Filter, Points, Settings, Sources, State, Strategy, Tracer},
};

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
    // A seed other than the default: a way that forgets it shows.
    Settings { bounces: 3, roulette: 2, seed: 7, ..Settings::default() }
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
        // The variances are those of independent samples.
        let base = Settings { bounces: 1, points: Points::Random, ..settings() };
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
        // Several parts of one submission.
        for paths in [64, 448, 1000] {
            let cut = traced(gpu, &scene, &view, |t| {
                t.set_together(paths);
                t.set_tile(Some(1 << 20));
                t.step(5).unwrap();
            });
            assert!(whole == cut, "{paths} paths together");
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
fn a_state_goes_on_with_its_own_settings_only() {
    with_gpu(|gpu| {
        let (scene, view) = mixed();
        let about = serde_json::json!({ "scene": 1 });
        let mut first = Tracer::new(gpu, &scene, &Pose::rest(&scene)).unwrap();
        first.start(&view, &settings()).unwrap();
        first.step(2).unwrap();
        let state = State::decode(&first.save(&about).unwrap().encode().unwrap()).unwrap();
        let base = settings();
        let others = [
            ("settings.seed was 7, now is 8", Settings { seed: 8, ..base.clone() }),
            ("settings.bounces was 3, now is 4", Settings { bounces: 4, ..base.clone() }),
            ("settings.specular_bounces was 8, now is 2", Settings { specular_bounces: 2, ..base.clone() }),
            ("settings.roulette was 2, now is 3", Settings { roulette: 3, ..base.clone() }),
            ("settings.diffuse_only was false, now is true", Settings { diffuse_only: true, ..base.clone() }),
            ("settings.sources", Settings { sources: Sources::Punctual, ..base.clone() }),
            ("settings.filter", Settings { filter: Filter::Centre, ..base.clone() }),
            ("settings.strategy", Settings { strategy: Strategy::Bsdf, ..base.clone() }),
            ("settings.points", Settings { points: Points::Random, ..base.clone() }),
            ("settings.planned was 0, now is 16", Settings { planned: 16, ..base.clone() }),
        ];
        let mut tracer = Tracer::new(gpu, &scene, &Pose::rest(&scene)).unwrap();
        let mut refused = |view: &View, settings: &Settings, about: serde_json::Value, part: &str| {
            tracer.start(view, settings).unwrap();
            let error = tracer.restore(&state, &about).expect_err(part);
            let text = error.to_string();
            assert!(error.exit_code() == 3 && text.contains(part), "{part:?} is not in {text}");
            // What differs is all that is named.
            assert!(!text.contains("; "), "{text}");
            assert_eq!(tracer.progress().unwrap().samples, 0.0, "{part}: the state was taken");
        };
        for (part, settings) in &others {
            refused(&view, settings, about.clone(), part);
        }
        refused(&view, &base, serde_json::json!({ "scene": 2 }), "scene was 1, now is 2");
        let moved = tracer_lab::view(vec3(0.8, 1.6, 3.4), vec3(0.0, 0.5, 0.0), 45.0, [24, 20]);
        refused(&moved, &base, about.clone(), "camera");
        // Whatever is in it: a setting that is added later is compared too.
        assert_eq!(serde_json::to_value(&base).unwrap().as_object().unwrap().len(), others.len());
    });
}

#[test]
fn another_seed_is_another_picture_of_the_same_light() {
    with_gpu(|gpu| {
        let (scene, view) = mixed();
        let of = |seed| render(gpu, &scene, &view, &Settings { seed, ..settings() }, 8);
        let pictures = [0, 1, 7, 1 << 31].map(of);
        for (i, a) in pictures.iter().enumerate() {
            for b in &pictures[..i] {
                let same = data(a, "").iter().zip(data(b, "")).filter(|(a, b)| a == b && **a != 0.0).count();
                assert!(same < data(a, "").len() / 50, "{same} numbers are the same");
                assert!(z(a, b) < 4.5, "{} deviations", z(a, b));
            }
        }
    });
}

/// Scenes in which one choice alone is random, with the settings that make it so.
fn single_choices() -> Vec<(&'static str, Scene, Settings)> {
    let floor = |stage: &mut Stage| {
        let floor = stage.material(Material::diffuse("floor", Vec3::splat(0.7)));
        stage.quad(floor, vec3(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0);
    };
    let slope = || {
        let pixels = (0..64 * 32).map(|i| Vec3::splat(0.5 + (i % 64) as f32 / 64.0 + (i / 64) as f32 / 20.0)).collect();
        Environment { width: 64, height: 32, pixels, ..Environment::constant(Vec3::ONE) }
    };
    let fixed = Settings { bounces: 0, ..matt(0) };
    let mut out = Vec::new();

    let mut stage = Stage::new();
    stage.scene.environment = Some(slope());
    out.push(("the place in the pixel", stage.scene, Settings { filter: Filter::Box, ..fixed.clone() }));

    let mut stage = Stage::new();
    floor(&mut stage);
    for x in [-1.0, 0.5, 1.2] {
        stage.point(vec3(x, 1.0, 0.3), Vec3::splat(2.0));
    }
    out.push(("which lamp", stage.scene, fixed.clone()));

    let mut stage = Stage::new();
    floor(&mut stage);
    let lamp = stage.emitter(Vec3::splat(3.0));
    let corners = vec![vec3(-0.5, 1.0, -0.5), vec3(0.5, 1.0, -0.5), vec3(0.0, 1.0, 0.5)];
    stage.mesh(lamp, corners, vec![Vec3::NEG_Y; 3], vec![0, 1, 2]);
    let lights = Settings { strategy: Strategy::Lights, ..fixed.clone() };
    out.push(("where on a lamp", stage.scene, lights.clone()));

    let mut stage = Stage::new();
    floor(&mut stage);
    for x in [-0.5, 0.5] {
        let down = Mat4::from_rotation_y(x) * Mat4::from_rotation_x(-1.0 - 0.5 * x);
        stage.light(LightKind::Directional, Vec3::ONE, 1.5 + x, down);
    }
    out.push(("which sun", stage.scene, fixed.clone()));

    let mut stage = Stage::new();
    floor(&mut stage);
    stage.scene.environment = Some(slope());
    out.push(("where in the sky", stage.scene.clone(), lights));
    out.push(("the way on", stage.scene, Settings { strategy: Strategy::Bsdf, ..fixed.clone() }));

    let mut stage = Stage::new();
    let lamp = stage.emitter(Vec3::splat(3.0));
    stage.quad(lamp, vec3(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0);
    let mut pane = Material { alpha: AlphaMode::Blend, ..Material::diffuse("pane", Vec3::ZERO) };
    pane.base_color.w = 0.5;
    let pane = stage.material(pane);
    stage.quad(pane, vec3(-2.0, 0.5, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0);
    out.push(("whether a blended surface is there", stage.scene, fixed.clone()));

    let mut stage = Stage::new();
    stage.scene.environment = Some(slope());
    let glass = Material { transmission: 1.0, roughness: 0.0, ..Material::diffuse("glass", Vec3::ONE) };
    let glass = stage.material(Material { double_sided: true, ior: 2.5, ..glass });
    stage.quad(glass, vec3(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0);
    out.push(("through glass or off it", stage.scene, Settings { diffuse_only: false, ..fixed.clone() }));

    let mut stage = Stage::new();
    let wall = stage.material(Material { emissive: Vec3::ONE, ..Material::diffuse("wall", Vec3::splat(0.5)) });
    stage.cuboid(wall, vec3(-2.0, -2.0, -3.0), vec3(2.0, 2.0, 4.0), true);
    // Rays meet the same light wherever they go, so that only where they end is random.
    let ending = Settings { bounces: 12, roulette: 0, strategy: Strategy::Bsdf, ..fixed };
    out.push(("where paths end", stage.scene, ending));
    out
}

#[test]
fn each_random_choice_depends_on_the_seed() {
    with_gpu(|gpu| {
        let seen = view(vec3(0.1, 1.5, 2.0), Vec3::ZERO, 50.0, [16, 16]);
        for (choice, scene, settings) in single_choices() {
            let of = |seed| render(gpu, &scene, &seen, &Settings { seed, ..settings.clone() }, 2);
            let (a, b, again) = (of(7), of(8), of(7));
            assert!(bits(&a) == bits(&again), "{choice}: not the same twice");
            let pixels = |layers: &Layers| data(layers, "").iter().step_by(3).copied().collect::<Vec<f32>>();
            let other = pixels(&a).iter().zip(pixels(&b)).filter(|(a, b)| **a != *b).count();
            // Two of two coins fall alike in three of eight pixels.
            assert!(other > 16 * 16 / 10, "{choice}: {other} of 256 pixels know of the seed");
        }
    });
}

#[test]
fn variances_are_those_of_the_samples() {
    with_gpu(|gpu| {
        let (scene, view) = mixed();
        let luminances = |n| {
            let layers = render(gpu, &scene, &view, &settings(), n);
            let each = data(&layers, "").chunks_exact(3).map(|p| luminance([0, 1, 2].map(|c| f64::from(p[c]))));
            (each.collect::<Vec<f64>>(), layers)
        };
        let pictures = [1, 2, 3].map(luminances);
        // The samples of a pixel, from the means of the first, the first two and all three.
        let mean = |n: usize, pixel: usize| pictures[n - 1].0[pixel] * n as f64;
        let (mut relative, mut spread) = (0.0, 0.0);
        let variance = data(&pictures[2].1, "variance");
        for (pixel, found) in variance.iter().enumerate() {
            let samples = [mean(1, pixel), mean(2, pixel) - mean(1, pixel), mean(3, pixel) - mean(2, pixel)];
            let middle = samples.iter().sum::<f64>() / 3.0;
            // The mean's: the unbiased variance of a sample over their number.
            let exact = samples.iter().map(|s| (s - middle).powi(2)).sum::<f64>() / 2.0 / 3.0;
            let slack = 1e-3 * exact + 1e-5 * middle * middle + 1e-12;
            assert!((f64::from(*found) - exact).abs() <= slack, "pixel {pixel}: {found} instead of {exact}");
            relative += exact / (middle * middle + 0.01) / variance.len() as f64;
            spread += exact;
        }
        assert!(spread > 0.0);
        let mut tracer = Tracer::new(gpu, &scene, &Pose::rest(&scene)).unwrap();
        tracer.render(&view, &settings(), 3).unwrap();
        let found = tracer.sums().unwrap().relative_error();
        assert!((found - relative).abs() < 1e-3 * relative, "{found} instead of {relative}");
    });
}

#[test]
fn thousands_of_samples_are_as_exact_as_one() {
    with_gpu(|gpu| {
        let mut stage = Stage::new();
        let lamp = stage.emitter(Vec3::splat(0.1));
        stage.quad(lamp, vec3(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0);
        let seen = view(vec3(0.0, 1.0, 0.0), Vec3::ZERO, 20.0, [1, 1]);
        // Added up plainly 2000 times, 0.1 comes out 1.5e-5 of it too large.
        let layers = render(gpu, &stage.scene, &seen, &matt(0), 2000);
        for name in ["", "emission"] {
            let found = data(&layers, name)[1];
            assert!((found - 0.1).abs() <= 0.1 * f32::EPSILON, "{name:?}: {found}");
        }
    });
}

#[test]
fn the_error_falls_as_one_over_the_samples_and_faster_with_sobol_points() {
    with_gpu(|gpu| {
        let mut stage = Stage::new();
        let (floor, lamp) =
            (stage.material(Material::diffuse("floor", Vec3::splat(0.8))), stage.emitter(Vec3::splat(4.0)));
        stage.quad(floor, vec3(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0);
        stage.quad(lamp, vec3(-0.5, 1.0, -0.5), Vec3::X, Vec3::Z);
        let seen = view(vec3(0.0, 0.9, 1.8), Vec3::ZERO, 60.0, [32, 32]);
        let settings = |seed, points| Settings { seed, points, filter: Filter::Centre, ..matt(0) };
        let reference = render(gpu, &stage.scene, &seen, &settings(99, Points::Sobol), 4096);
        let counts = [4u32, 16, 64, 256];
        let errors_and_slope = |points| {
            let errors: Vec<f64> = counts
                .iter()
                .map(|&n| {
                    let picture = render(gpu, &stage.scene, &seen, &settings(n, points), n);
                    let pairs = data(&picture, "").iter().zip(data(&reference, ""));
                    pairs.map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>() / data(&picture, "").len() as f64
                })
                .collect();
            let x: Vec<f64> = counts.iter().map(|&n| f64::from(n).ln()).collect();
            let y: Vec<f64> = errors.iter().map(|e| e.ln()).collect();
            let (mx, my) = (x.iter().sum::<f64>() / 4.0, y.iter().sum::<f64>() / 4.0);
            let slope = x.iter().zip(&y).map(|(x, y)| (x - mx) * (y - my)).sum::<f64>()
                / x.iter().map(|x| (x - mx).powi(2)).sum::<f64>();
            (errors, slope)
        };
        let (errors, slope) = errors_and_slope(Points::Random);
        assert!((slope + 1.0).abs() < 0.12, "slope {slope}, errors {errors:?}");
        // The light of a lamp that nothing hides is smooth in two dimensions.
        let (fewer, steeper) = errors_and_slope(Points::Sobol);
        assert!(
            steeper < -1.7 && fewer[3] < errors[3] / 30.0,
            "slope {steeper}, errors {fewer:?} instead of {errors:?}"
        );
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
