//! What a scene was made ready for, and what is said of what is not served.

mod fiv_lab;
mod tracer_lab;

use fiv_lab::{Studio, ball, colourful, ground, thing};
use glam::{Mat4, Vec3, vec3};
use lucerna::{
    gpu::testing::with_gpu,
    graph::Graph,
    scene::{Pose, Scene, View, builtin, resident::Resident},
    techniques::fiv::{Fiv, Method, PictureSettings, SelfSamples, Settings, Shared, Stored},
};
use tracer_lab::flat_view;

fn coarse() -> Settings {
    Settings { size: 8, azimuths: 8, polars: 5, radii: 4, largest: 1.0, ..Settings::default() }
}

fn ball_over_ground() -> Scene {
    let mut scene = Scene { environment: Some(colourful()), ..Scene::default() };
    ground(&mut scene, 20.0);
    let (positions, indices) = ball(0.5, 8);
    thing(&mut scene, "ball", positions, indices, Mat4::from_translation(vec3(0.0, 0.8, 0.0)));
    scene
}

#[test]
fn vectors_are_drawn_under_their_own_light_only() {
    with_gpu(|gpu| {
        let (scene, view) = (ball_over_ground(), flat_view(Vec3::Y * 10.0, Vec3::ZERO, 3.0, [16, 16]));
        let with = |rotation, method| Settings { rotation, method, ..coarse() };
        let mut studio = Studio::new(gpu, &scene, &coarse(), None);
        let before = studio.irradiance(&view, &with(0.0, Method::Vectors));
        // Without shadows any light will do; after it the vectors are still for theirs.
        let turned = studio.irradiance(&view, &with(90.0, Method::Unshadowed));
        let error = studio.refused(&view, &with(90.0, Method::Vectors));
        assert!(error.exit_code() == 2 && error.to_string().contains("another turn"), "{error}");
        let after = studio.irradiance(&view, &with(0.0, Method::Vectors));
        assert!(before == after && before != turned);
    });
}

#[test]
fn a_picture_asks_for_what_the_scene_was_made_ready_for() {
    with_gpu(|gpu| {
        let (scene, view) = (ball_over_ground(), flat_view(Vec3::Y * 10.0, Vec3::ZERO, 3.0, [16, 16]));
        let made = Settings { shared: Shared::Discs, ..coarse() };
        let mut studio = Studio::new(gpu, &scene, &made, None);
        for (wrong, key) in [
            (Settings { size: 16, ..made.clone() }, "fiv.size"),
            (Settings { flat: true, ..made.clone() }, "fiv.flat"),
            (Settings { largest: 0.2, ..made.clone() }, "fiv.largest"),
            (Settings { self_samples: SelfSamples::Spheres, ..made.clone() }, "fiv.self_samples"),
            (Settings { shared: Shared::Filled, ..made.clone() }, "fiv.shared"),
            (Settings { method: Method::BruteForce, ..made.clone() }, "fiv.method"),
        ] {
            let error = studio.refused(&view, &wrong);
            assert!(error.exit_code() == 2 && error.to_string().contains(key), "{error} without {key}");
        }
        studio.irradiance(&view, &Settings { overlap: false, shared: Shared::Filled, ..made.clone() });
    });
}

#[test]
fn what_would_not_fit_is_refused_before_anything_is_computed() {
    with_gpu(|gpu| {
        let scene = ball_over_ground();
        let resident = Resident::new(gpu, &scene).unwrap();
        let huge = Settings { azimuths: 1024, polars: 513, radii: 128, turns: 64, ..coarse() };
        let error = Fiv::new(gpu, &scene, &resident, &huge, None, |_, _| panic!("computed")).unwrap_err();
        let text = error.to_string();
        assert!(error.exit_code() == 1 && text.contains("bytes") && text.contains("fiv.turns"), "{text}");
    });
}

#[test]
fn what_a_file_of_vectors_lacks_is_named() {
    with_gpu(|gpu| {
        let scene = ball_over_ground();
        let studio = Studio::new(gpu, &scene, &coarse(), None);
        let none = Stored {
            plan: lucerna::techniques::fiv::Plan { occluders: vec![], ..studio.fiv.plan().clone() },
            range: 0..0,
            fivs: vec![],
        };
        let resident = Resident::new(gpu, &scene).unwrap();
        let fiv = Fiv::new(gpu, &scene, &resident, &coarse(), Some(&none), |_, _| true).unwrap();
        let notes: Vec<_> = fiv.notes().iter().map(|n| format!("{}: {}", n.place, n.text)).collect();
        assert!(notes.iter().any(|n| n.contains("computed: `ball`")), "{notes:?}");
        assert!(studio.fiv.notes().iter().all(|n| n.place != "vectors"));
    });
}

#[test]
fn what_turns_or_deforms_is_named() {
    with_gpu(|gpu| {
        let scene = builtin::load("shadows-moving").unwrap();
        let settings = Settings { largest: 0.5, self_samples: SelfSamples::Spheres, ..coarse() };
        let mut resident = Resident::new(gpu, &scene).unwrap();
        let mut fiv = Fiv::new(gpu, &scene, &resident, &settings, None, |_, _| true).unwrap();
        let mut notes = |seconds: f32| {
            let pose = Pose::playing(&scene, seconds);
            let mut graph = Graph::new("fiv");
            let handles = resident.frame_in(&mut graph, &scene, &pose);
            let view = View::of_camera(&scene, &pose, 0, [16, 16]).unwrap();
            let all = PictureSettings { fiv: settings.clone(), ..Default::default() };
            let picture = fiv.picture(&mut graph, &scene, &pose, &handles, &view, &all).unwrap();
            picture.notes.iter().map(|n| format!("{}: {}", n.place, n.text)).collect::<Vec<_>>()
        };
        let told = notes(1.3);
        assert!(told.iter().any(|n| n.contains("sculpture") && n.contains("deforms")), "{told:?}");
        assert!(told.iter().any(|n| n.contains("turns")), "{told:?}");
    });
}
