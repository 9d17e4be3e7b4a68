//! The interface of all techniques: each is found by its name, renders, and names the settings that it is prepared by.

use glam::Vec2;
use lucerna::{
    Result,
    gpu::{Gpu, testing::with_gpu},
    graph::{Graph, Runner},
    scene::{Pose, Scene, View},
    technique::{Mode, Ready, Settings, Shot, Technique},
    techniques::{self, Visitor, fiv::Fiv, igi::Igi, isr::Isr},
};
use lucerna_scenes as builtin;
use serde_json::{Value, json};

/// A chess queen under a built-in environment, which all techniques can render.
fn queen() -> Scene {
    Scene { environment: Some(builtin::environment("grove").unwrap()), ..builtin::load("queen").unwrap() }
}

fn view() -> View {
    let camera = lucerna::scene::Camera {
        name: String::new(),
        projection: lucerna::scene::Projection::Perspective { yfov: 0.7, aspect: None, znear: 0.1, zfar: None },
    };
    // Cameras look down −Z.
    let at = glam::Mat4::from_translation(glam::vec3(0.0, 0.5, 2.5));
    View::new(&camera, at, [24, 32])
}

/// Renders one frame in each mode, and returns the layers of the first.
struct Render<'a> {
    gpu: &'a Gpu,
    settings: Value,
}

impl Visitor for Render<'_> {
    type Output = Result<Vec<String>>;

    fn visit<T: Technique + 'static>(self) -> Self::Output {
        let (scene, view) = (queen(), view());
        let pose = Pose::rest(&scene);
        let settings: T::Settings = serde_json::from_value(self.settings).unwrap();
        settings.validate()?;
        let mut ready = Ready::<T>::new(self.gpu, &scene, &settings, None, &mut |_, _| true)?;
        let mut names = Vec::new();
        for &mode in T::Mode::ALL {
            let mut graph = Graph::new(T::NAME);
            let shot = Shot { mode, ..Shot::default() };
            let picture = ready.frame(&mut graph, (&scene, &pose), &view, shot, &settings)?;
            assert!(picture.view.is_some_and(|shown| shown.far.is_finite()), "the far plane is fitted");
            let readback = picture.read(&mut graph, true, true);
            let layers = readback.layers(&Runner::new(self.gpu).run(&graph)?);
            assert_eq!((layers.width, layers.height), (24, 32));
            let total = layers.main().unwrap();
            assert!(total.data.iter().all(|x| x.is_finite()), "{} {}", T::NAME, mode.name());
            // All but the path tracer, which adds up its frames itself, have an average over time.
            if T::NAME != "reference" {
                let averaged = Shot { temporal: Some(Default::default()), ..shot };
                let picture = ready.frame(&mut Graph::new(T::NAME), (&scene, &pose), &view, averaged, &settings);
                assert_eq!(picture.is_ok(), mode.is_radiance(), "{} {}", T::NAME, mode.name());
                // And its light can serve more places of a pixel.
                let places = std::array::from_fn(|i| Vec2::splat(0.06 * i as f32));
                let smooth = Shot { edges: Some(places), ..shot };
                let mut graph = Graph::new(T::NAME);
                let picture = ready.frame(&mut graph, (&scene, &pose), &view, smooth, &settings);
                assert_eq!(picture.is_ok(), mode.is_radiance(), "{} {}", T::NAME, mode.name());
                if let Ok(picture) = picture {
                    let readback = picture.read(&mut graph, true, true);
                    let smooth = readback.layers(&Runner::new(self.gpu).run(&graph)?);
                    assert!(smooth.main().unwrap().data.iter().all(|x| x.is_finite()), "{} {}", T::NAME, mode.name());
                }
            }
            if mode.is_radiance() {
                // The queen stands in the middle of the picture, and the environment lights it.
                let middle = total.rgb_pixels().unwrap()[16 * 24 + 12];
                assert!(middle.iter().all(|x| *x >= 0.0), "{} {}: {middle:?}", T::NAME, mode.name());
                assert!(mode != T::Mode::default() || middle.iter().all(|x| *x > 0.0), "{}: {middle:?}", T::NAME);
            }
            let depth = layers.layer("depth").unwrap().data[16 * 24 + 12];
            assert!((1.5..3.5).contains(&depth), "{depth} m to the queen");
            if names.is_empty() {
                names = layers.layers.iter().map(|layer| layer.name.clone()).collect();
            }
        }
        Ok(names)
    }
}

#[test]
fn each_technique_renders_by_its_name_in_all_its_modes() {
    with_gpu(|gpu| {
        for (name, settings, own) in [
            ("isr", json!({}), vec!["direct", "indirect", "occlusion"]),
            ("igi", json!({ "igi": { "vpls": 16, "candidates": 1 } }), vec!["direct", "indirect"]),
            ("fiv", json!({ "fiv": { "method": "unshadowed" } }), vec!["irradiance"]),
            ("reference", json!({ "samples": 8 }), vec!["direct", "indirect", "emission", "position", "variance"]),
        ] {
            let layers = techniques::visit(name, Render { gpu, settings }).unwrap().unwrap();
            for layer in own.iter().chain(&["albedo", "normal", "depth"]) {
                assert!(layers.iter().any(|found| found == layer), "{name}: {layer} of {layers:?}");
            }
        }
    });
}

#[test]
fn names_find_techniques_and_no_other_words_do() {
    struct Name;
    impl Visitor for Name {
        type Output = &'static str;
        fn visit<T: Technique + 'static>(self) -> &'static str {
            T::NAME
        }
    }
    for name in techniques::NAMES {
        assert_eq!(techniques::visit(name, Name), Some(*name));
    }
    for name in ["", "ISR", "tonemap", "is"] {
        assert_eq!(techniques::visit(name, Name), None, "{name:?}");
    }
}

#[test]
fn what_prepares_a_technique_is_what_ready_reads() {
    fn by<T: Technique>(settings: Value) -> T::Settings {
        let settings: T::Settings = serde_json::from_value(settings).unwrap();
        let by = T::prepared_by(&settings);
        assert_eq!(T::prepared_by(&by), by, "the same settings prepare the same");
        by
    }
    assert_eq!(by::<Isr>(json!({ "isr": { "samples": 24 } })), by::<Isr>(json!({})));
    assert_eq!(by::<Igi>(json!({ "igi": { "vpls": 7 } })), by::<Igi>(json!({})));
    assert_ne!(by::<Igi>(json!({ "igi": { "imperfect": true } })), by::<Igi>(json!({})));
    assert_ne!(by::<Igi>(json!({ "igi": { "visibility": "raster" } })), by::<Igi>(json!({})));
    assert_eq!(by::<Fiv>(json!({ "fiv": { "overlap": false } })), by::<Fiv>(json!({})));
    for key in ["azimuths", "polars", "radii"] {
        assert_ne!(by::<Fiv>(json!({ "fiv": { key: 9 } })), by::<Fiv>(json!({})), "{key}");
    }
}

#[test]
fn a_stopped_preparation_is_an_error() {
    with_gpu(|gpu| {
        let (scene, settings) = (queen(), json!({ "fiv": { "azimuths": 6, "polars": 3, "radii": 2, "size": 8 } }));
        let mut asked = 0;
        let mut told = |done: u64, all: u64| {
            assert!(done <= all);
            asked += 1;
            false
        };
        let ready = Ready::<Fiv>::new(gpu, &scene, &serde_json::from_value(settings).unwrap(), None, &mut told);
        assert!(ready.is_err() && asked == 1, "{asked}");
    });
}
