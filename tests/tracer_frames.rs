//! The path tracer's other ways to a picture: frame by frame behind the interface of all techniques, and in bands of rows. Both give the
//! picture of one run.

use crate::tracer_lab::{Stage, view};
use glam::{Vec3, vec3};
use lucerna::{
    bake::{self, Store},
    gpu::testing::with_gpu,
    graph::{Graph, Runner},
    image::Layers,
    scene::{Environment, Material, Pose, Scene, View},
    technique::{Ready, Shot},
    tracer::{Mode, PictureSettings, Reference, Settings, Tracer, bands},
};
use serde_json::json;

/// A floor, a ball of glass and a lamp under a sky.
fn stage() -> Scene {
    let mut stage = Stage::new();
    let floor = stage.material(Material { roughness: 0.4, ..Material::diffuse("floor", vec3(0.7, 0.6, 0.5)) });
    let glass = stage.material(Material { transmission: 0.9, ..Material::diffuse("glass", vec3(0.9, 1.0, 0.8)) });
    let lamp = stage.emitter(vec3(6.0, 5.0, 4.0));
    stage.quad(floor, vec3(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0);
    stage.sphere(glass, vec3(0.5, 0.5, 0.2), 0.4, 10, false);
    stage.quad(lamp, vec3(-0.6, 2.0, -0.3), Vec3::X * 0.9, Vec3::Z * 0.6);
    stage.scene.environment = Some(Environment::constant(vec3(0.2, 0.3, 0.5)));
    stage.scene
}

fn at(extent: [u32; 2]) -> View {
    view(vec3(0.8, 1.6, 3.5), vec3(0.0, 0.5, 0.0), 45.0, extent)
}

fn settings() -> Settings {
    Settings { bounces: 3, seed: 7, ..Settings::default() }
}

/// The largest difference, relative to the larger of 1 and the value.
fn difference(a: &Layers, b: &Layers, name: &str) -> f32 {
    let data = |layers: &Layers| layers.layer(name).unwrap().data.clone();
    let (a, b) = (data(a), data(b));
    assert_eq!(a.len(), b.len(), "{name}");
    a.iter().zip(&b).map(|(a, b)| (a - b).abs() / b.abs().max(1.0)).fold(0.0, f32::max)
}

#[test]
fn frames_add_up_to_the_picture_of_one_run_and_any_change_begins_another() {
    with_gpu(|gpu| {
        let scene = stage();
        let pose = Pose::rest(&scene);
        let mut ready =
            Ready::<Reference>::new(gpu, &scene, &PictureSettings::default(), None, &mut |_, _| true).unwrap();
        let mut runner = Runner::new(gpu);
        let mut frame = |view: &View, settings: &Settings, samples: u32, mode: Mode| {
            let settings = PictureSettings { samples, reference: settings.clone() };
            let mut graph = Graph::new("frame");
            let picture = ready.frame(&mut graph, (&scene, &pose), view, Shot { mode, ..Shot::default() }, &settings);
            let readback = picture.unwrap().read(&mut graph, true, true);
            let frame = runner.run(&graph).unwrap();
            let error = readback.sums(&frame).iter().find(|(name, _)| name == "relative_error").unwrap().1;
            (readback.layers(&frame), error, ready.technique().samples())
        };
        let whole = |view: &View, settings: &Settings, samples: u32| {
            let mut tracer = Tracer::new(gpu, &scene, &pose).unwrap();
            let layers = tracer.render(view, settings, samples).unwrap();
            (layers, tracer.sums().unwrap().relative_error() * 480.0)
        };
        let (front, side) = (at([24, 20]), view(vec3(3.5, 1.6, 0.8), Vec3::ZERO, 45.0, [24, 20]));
        let other = Settings { bounces: 0, ..settings() };
        // Two frames are one picture; the next has another view, the next other settings, the last the first view again.
        for (view, settings, samples, sum) in [
            (&front, &settings(), 2, 2),
            (&front, &settings(), 3, 5),
            (&side, &settings(), 4, 4),
            (&side, &other, 3, 3),
            (&front, &settings(), 2, 2),
        ] {
            let (layers, error, count) = frame(view, settings, samples, Mode::Total);
            assert_eq!(count, sum);
            let (wanted, wanted_error) = whole(view, settings, sum as u32);
            for name in ["", "direct", "indirect", "emission", "albedo", "normal", "position", "depth", "samples"] {
                let off = difference(&layers, &wanted, name);
                // Layers that are not the total are stored as half floats in files only; here all have 32 bits.
                assert!(off < 2e-6, "`{name}` after {sum} samples: {off}");
            }
            let off = difference(&layers, &wanted, "variance");
            assert!(off < 1e-4, "variance after {sum} samples: {off}");
            assert!((error / wanted_error - 1.0).abs() < 1e-3, "relative error {error}, wanted {wanted_error}");
        }
        // Other light of the same picture.
        let (layers, _, count) = frame(&front, &settings(), 1, Mode::Indirect);
        let (wanted, _) = whole(&front, &settings(), 3);
        assert_eq!(count, 3);
        assert_eq!(layers.main().unwrap().data, layers.layer("indirect").unwrap().data);
        assert!(difference(&layers, &wanted, "indirect") < 2e-6);
    });
}

#[test]
fn bands_join_to_the_bits_of_a_picture_that_is_traced_as_a_whole() {
    with_gpu(|gpu| {
        let scene = stage();
        let (pose, view, about) = (Pose::rest(&scene), at([211, 190]), json!({ "scene": "a" }));
        let tracer = || {
            let mut tracer = Tracer::new(gpu, &scene, &pose).unwrap();
            tracer.start(&view, &settings()).unwrap();
            tracer
        };
        let mut whole = tracer();
        whole.run(3, |_| true).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let mut first = tracer();
        let store = Store::create(&folder.path().join("a.parts"), first.bands(3, &about).unwrap()).unwrap();
        assert_eq!(store.job().units().count(), bands::of(view.extent).len());
        assert!(store.job().units().count() > 1);
        // Two tracers, as two machines would, each from its own end.
        let mut second = tracer();
        let units: Vec<_> = store.job().units().collect();
        for (number, unit) in units.iter().rev().enumerate() {
            let tracer = if number % 2 == 0 { &mut first } else { &mut second };
            store.put(*unit, &tracer.band(*unit, 3, || true).unwrap()).unwrap();
        }
        let mut joined = tracer();
        joined.join(&store, 3).unwrap();
        assert!(joined.sums().unwrap() == whole.sums().unwrap());
        assert_eq!(joined.progress().unwrap().samples, 3.0);
        // The next samples go on over the whole picture.
        joined.run(5, |_| true).unwrap();
        whole.run(5, |_| true).unwrap();
        assert!(joined.sums().unwrap() == whole.sums().unwrap());
        // A stopped band has no bytes; other pictures are other jobs; a damaged unit is named.
        first.set_tile(Some(64));
        assert_eq!(first.band(units[0], 3, || false).unwrap_err().exit_code(), 130);
        for other in [first.bands(4, &about).unwrap(), first.bands(3, &json!({ "scene": "b" })).unwrap()] {
            assert!(Store::create(store.folder(), other).is_err());
        }
        let path = store.path(units[1]);
        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(&path, &bytes[..bytes.len() - 1]).unwrap();
        let error = joined.join(&store, 3).unwrap_err();
        assert!(error.exit_code() == 3 && error.to_string().contains(".unit"), "{error}");
        std::fs::write(&path, bake::unit::encode(store.job().key().digest(), units[1], &[0; 64]).unwrap()).unwrap();
        let error = joined.join(&store, 3).unwrap_err().to_string();
        assert!(error.contains("64 bytes"), "{error}");
    });
}
