//! Settings that a scene was prepared with, settings of its pictures, and notes on everything that is not supported.

use crate::fiv_lab::{Studio, ball, colourful, ground, occluder, thing};
use crate::tracer_lab::flat_view;
use glam::{Mat4, Vec3, vec3};
use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    graph::{Graph, Runner},
    resident::Resident,
    scene::{AlphaMode, Environment, Pose, Scene, View},
    techniques::fiv::{
        Cut, Extent, Fiv, Interpolation, Masks, Method, PictureSettings, SelfSamples, Settings, Shared, Specular,
        Stored, occluder_rotation::Axis,
    },
};
use lucerna_scenes as builtin;

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

/// The vectors of a scene in the form of a file.
fn stored(gpu: &Gpu, scene: &Scene, settings: &Settings) -> Stored {
    let studio = Studio::new(gpu, scene, settings, None);
    let (plan, kinds) = (studio.fiv.plan().clone(), &studio.fiv.occluders().kinds);
    let mut stored = Stored::empty(plan.clone(), 0);
    let light = studio.fiv.light();
    plan.compute(gpu, light, kinds, 0..plan.samples(), |_, new| {
        stored.push(new);
        Ok(true)
    })
    .unwrap();
    stored
}

#[test]
fn files_of_blended_occluders_made_when_masks_were_others_are_out_of_date() {
    // A tetrahedron.
    let hash = |alpha: AlphaMode| {
        let mut scene = Scene::default();
        let corners = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
        thing(&mut scene, "body", corners, vec![0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3], Mat4::IDENTITY);
        scene.materials[0].alpha = alpha;
        format!("{:016x}", occluder(&scene).0.hash)
    };
    // Hashes of an earlier version. Rays hit solid and cut surfaces as in that version.
    assert_eq!(hash(AlphaMode::Opaque), "d534c1090e9bdb08");
    assert_eq!(hash(AlphaMode::Mask { cutoff: 0.5 }), "1d84918ee84c41f5");
    assert_ne!(hash(AlphaMode::Blend), "6bcef818bd52b9b8");
}

#[test]
fn a_turn_that_stays_is_exact_for_every_method() {
    with_gpu(|gpu| {
        let (scene, view) = (ball_over_ground(), flat_view(Vec3::Y * 10.0, Vec3::ZERO, 3.0, [8, 8]));
        let turned = Environment { rotation: 37f32.to_radians(), ..scene.environment.clone().unwrap() };
        let itself = Scene { environment: Some(turned), ..scene.clone() };
        for method in [Method::Unshadowed, Method::BruteForce, Method::Online] {
            let [still, asked] = [0.0, 37.0].map(|rotation| Settings { rotation, method, ..coarse() });
            let exact = Studio::new(gpu, &itself, &still, None).irradiance(&view, &still);
            assert!(Studio::new(gpu, &scene, &asked, None).irradiance(&view, &asked) == exact, "{method:?}");
            // The same light results if a picture asks for the rotation, whatever picture came before.
            let mut studio = Studio::new(gpu, &scene, &still, None);
            assert!(studio.irradiance(&view, &still) != exact);
            let turning = Settings { turning: 1.0, ..asked.clone() };
            let nearly = studio.irradiance(&view, &turning);
            assert!(studio.irradiance(&view, &asked) == exact, "{method:?}");
            // An environment that keeps rotating is resampled from means.
            assert!(nearly != exact && studio.irradiance(&view, &turning) == nearly, "{method:?}");
        }
    });
}

#[test]
fn another_environment_than_that_of_the_vectors_is_refused_or_followed() {
    with_gpu(|gpu| {
        let (scene, view) = (ball_over_ground(), flat_view(Vec3::Y * 10.0, Vec3::ZERO, 3.0, [4, 4]));
        let ours = scene.environment.clone().unwrap();
        let mut resident = Resident::new(gpu, &scene).unwrap();
        let with = |method| Settings { method, ..coarse() };
        let mut runner = Runner::new(gpu);
        let mut picture = |fiv: &mut Fiv, environment: &Environment, method| {
            let lit = Scene { environment: Some(environment.clone()), ..scene.clone() };
            let mut graph = Graph::new("fiv");
            let pose = Pose::rest(&scene);
            let handles = resident.frame_in(&mut graph, &scene, &pose);
            let all = PictureSettings { fiv: with(method), ..Default::default() };
            let picture = fiv.picture(&mut graph, &lit, &pose, &handles, &view, &all)?;
            let read = graph.read_image(picture.outputs.irradiance);
            Ok::<_, lucerna::Error>(runner.run(graph)?.image(read).to_f32())
        };
        let sources = Resident::new(gpu, &scene).unwrap();
        let of = |environment: &Environment, method| {
            let lit = Scene { environment: Some(environment.clone()), ..scene.clone() };
            Fiv::new(gpu, &lit, &sources, &with(method), None, |_, _| true).unwrap()
        };
        let mut fiv = of(&ours, Method::Vectors);
        let whole = picture(&mut fiv, &ours, Method::Vectors).unwrap();
        let brighter = Environment { pixels: ours.pixels.iter().map(|p| *p * 1.5).collect(), ..ours.clone() };
        let others = [
            brighter,
            Environment { width: ours.height, height: ours.width, ..ours.clone() },
            builtin::environment("areas").unwrap(),
        ];
        for other in &others {
            let error = picture(&mut fiv, other, Method::Vectors).unwrap_err();
            assert!(error.exit_code() == 2 && error.to_string().contains("not the environment"), "{error}");
        }
        // A change of one pixel is detected by methods that keep no data of the environment.
        let mut pixels = ours.pixels.clone();
        pixels[1] += 1e4;
        let spot = Environment { pixels, ..ours.clone() };
        for method in [Method::Online, Method::BruteForce, Method::Unshadowed] {
            let mut fiv = of(&ours, method);
            let before = picture(&mut fiv, &ours, method).unwrap();
            for other in [&others[0], &others[2], &spot] {
                let found = picture(&mut fiv, other, method).unwrap();
                let made = picture(&mut of(other, method), other, method).unwrap();
                assert!(found == made && found != before, "{method:?}");
            }
            assert_eq!(picture(&mut fiv, &ours, method).unwrap(), before);
        }
        assert_eq!(picture(&mut fiv, &ours, Method::Vectors).unwrap(), whole);
    });
}

#[test]
fn vectors_are_drawn_under_their_own_light_only() {
    with_gpu(|gpu| {
        let (scene, view) = (ball_over_ground(), flat_view(Vec3::Y * 10.0, Vec3::ZERO, 3.0, [16, 16]));
        let with = |rotation, method| Settings { rotation, method, ..coarse() };
        let mut studio = Studio::new(gpu, &scene, &coarse(), None);
        let before = studio.irradiance(&view, &with(0.0, Method::Vectors));
        // Without shadows any rotation is allowed. Afterwards the vectors are still valid for their own rotation.
        let turned = studio.irradiance(&view, &with(90.0, Method::Unshadowed));
        let error = studio.refused(&view, &with(90.0, Method::Vectors));
        assert!(error.exit_code() == 2 && error.to_string().contains("another rotation"), "{error}");
        let after = studio.irradiance(&view, &with(0.0, Method::Vectors));
        assert!(before == after && before != turned);
    });
}

#[test]
fn pictures_may_choose_only_settings_that_preparation_leaves_open() {
    with_gpu(|gpu| {
        let (scene, view) = (ball_over_ground(), flat_view(Vec3::Y * 10.0, Vec3::ZERO, 3.0, [4, 4]));
        let made = coarse();
        let x = Axis::new(Vec3::X).unwrap();
        let fixed = [
            ("size", Settings { size: 16, ..made.clone() }),
            ("azimuths", Settings { azimuths: 9, ..made.clone() }),
            ("polars", Settings { polars: 6, ..made.clone() }),
            ("radii", Settings { radii: 5, ..made.clone() }),
            ("turns", Settings { turns: 2, ..made.clone() }),
            ("turn_axis", Settings { turn_axis: x, ..made.clone() }),
            ("suns", Settings { suns: 1, ..made.clone() }),
            ("reach", Settings { reach: 8.0, ..made.clone() }),
            ("adaptive", Settings { adaptive: false, ..made.clone() }),
            ("split", Settings { split: 2, ..made.clone() }),
            ("masks", Settings { masks: Masks::Parallel, ..made.clone() }),
            ("flat", Settings { flat: true, ..made.clone() }),
            ("largest", Settings { largest: 0.2, ..made.clone() }),
            ("interpolation", Settings { interpolation: Interpolation::SolidAngle, ..made.clone() }),
            ("self_samples", Settings { self_samples: SelfSamples::Spheres, ..made.clone() }),
            ("specular", Settings { specular: Specular::Summed, ..made.clone() }),
            ("method", Settings { method: Method::BruteForce, ..made.clone() }),
        ];
        let free = [
            ("trilinear", Settings { trilinear: false, ..made.clone() }),
            ("partial", Settings { partial: false, ..made.clone() }),
            ("cut", Settings { cut: Cut::Height, ..made.clone() }),
            ("extent", Settings { extent: Extent::Sphere, ..made.clone() }),
            ("overlap", Settings { overlap: false, ..made.clone() }),
            ("negligible", Settings { negligible: 0.1, ..made.clone() }),
            ("shared", Settings { shared: Shared::Discs, ..made.clone() }),
            ("self_shadow", Settings { self_shadow: false, ..made.clone() }),
            ("hide_occluders", Settings { hide_occluders: true, ..made.clone() }),
        ];
        // The remaining keys belong to the environment, whose rotation the vectors have fixed.
        let known: Vec<&str> = [&fixed[..], &free[..]].concat().iter().map(|(key, _)| *key).collect();
        let serde_json::Value::Object(all) = serde_json::to_value(&made).unwrap() else { panic!("no table") };
        let others: Vec<_> = all.keys().filter(|key| !known.contains(&key.as_str())).collect();
        assert_eq!(others, ["exposure", "rotation", "turning"]);
        let mut studio = Studio::new(gpu, &scene, &made, None);
        for (key, wrong) in fixed {
            let error = studio.refused(&view, &wrong);
            assert!(error.exit_code() == 2 && error.place() == Some(&format!("fiv.{key}")), "{error} without {key}");
        }
        for (key, choice) in free {
            let found = studio.irradiance(&view, &choice);
            // The picture equals the picture of a scene prepared with this choice.
            if ["cut", "shared"].contains(&key) {
                let mut other = Studio::new(gpu, &scene, &choice, None);
                assert!(found == other.irradiance(&view, &choice), "{key}");
                assert!(studio.irradiance(&view, &made) == other.irradiance(&view, &made), "{key}");
            }
        }
    });
}

#[test]
fn what_a_file_decides_may_be_asked_for_as_it_was_given() {
    with_gpu(|gpu| {
        let (scene, view) = (ball_over_ground(), flat_view(Vec3::Y * 10.0, Vec3::ZERO, 3.0, [8, 8]));
        let even = Settings { adaptive: false, azimuths: 10, ..coarse() };
        let stored = stored(gpu, &scene, &even);
        // The file says that its samples are evenly spaced.
        assert_eq!(stored.plan.settings(&coarse()), even);
        let mut second = Studio::new(gpu, &scene, &coarse(), Some(&stored));
        let exact = second.irradiance(&view, &even);
        assert!(second.irradiance(&view, &coarse()) == exact);
        let error = second.refused(&view, &Settings { azimuths: 11, ..coarse() });
        assert_eq!(error.place(), Some("fiv.azimuths"));
    });
}

#[test]
fn a_file_has_chosen_where_samples_lie_whatever_is_interpolated() {
    with_gpu(|gpu| {
        let (scene, view) = (ball_over_ground(), flat_view(Vec3::Y * 10.0, Vec3::ZERO, 3.0, [8, 8]));
        let stored = stored(gpu, &scene, &coarse());
        let other = Settings { interpolation: Interpolation::SolidAngle, ..coarse() };
        let mut studio = Studio::new(gpu, &scene, &coarse(), Some(&stored));
        let exact = Studio::new(gpu, &scene, &other, Some(&stored)).irradiance(&view, &other);
        assert!(studio.irradiance(&view, &other) == exact && studio.irradiance(&view, &coarse()) != exact);
        // The spacing that was computed for the scene depends on the interpolation.
        let error = Studio::new(gpu, &scene, &coarse(), None).refused(&view, &other);
        assert_eq!(error.place(), Some("fiv.interpolation"));
    });
}

#[test]
fn own_shadows_are_there_if_the_scene_was_made_with_them() {
    with_gpu(|gpu| {
        let (scene, view) = (ball_over_ground(), flat_view(Vec3::Y * 10.0, Vec3::ZERO, 3.0, [16, 16]));
        let without = Settings { self_shadow: false, ..coarse() };
        let mut studio = Studio::new(gpu, &scene, &without, None);
        let around = u64::from(without.grid().count());
        assert_eq!(studio.fiv.plan().samples(), around, "places on the surface are computed for nothing");
        let error = studio.refused(&view, &coarse());
        assert!(error.exit_code() == 2 && error.to_string().contains("fiv.self_shadow"), "{error}");
        let found = studio.irradiance(&view, &without);
        let mut studio = Studio::new(gpu, &scene, &coarse(), None);
        assert!(studio.fiv.plan().samples() > around);
        assert!(studio.irradiance(&view, &without) == found);
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
fn what_a_file_lacks_for_own_shadows_and_keys_that_do_nothing_online_are_named() {
    with_gpu(|gpu| {
        let scene = ball_over_ground();
        let told = |settings: &Settings, stored: Option<&Stored>| {
            let studio = Studio::new(gpu, &scene, settings, stored);
            studio.fiv.notes().iter().map(|n| format!("{}: {}", n.place, n.text)).collect::<Vec<_>>()
        };
        let without = Settings { self_shadow: false, ..coarse() };
        let stored = stored(gpu, &scene, &without);
        let named = |notes: &[String]| notes.iter().any(|n| n.starts_with("vectors:") && n.contains("on surfaces"));
        let notes = told(&coarse(), Some(&stored));
        assert!(named(&notes) && notes.iter().any(|n| n.contains("fiv.self_samples=surface")), "{notes:?}");
        assert!(!named(&told(&without, Some(&stored))) && !named(&told(&coarse(), None)));
        let online = Settings { method: Method::Online, adaptive: false, ..coarse() };
        let notes = told(&online, None);
        assert!(notes.iter().any(|n| n.starts_with("fiv.adaptive: has no effect")), "{notes:?}");
        assert!(told(&Settings { adaptive: false, ..coarse() }, None).iter().all(|n| !n.contains("fiv.adaptive")));
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
        assert!(told.iter().any(|n| n.contains("rotates")), "{told:?}");
    });
}
