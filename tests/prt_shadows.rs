//! Precomputed transfer: shadows by maps and by samples, and which of them a picture has.

use crate::{
    prt_lab::{baked, diffuse, picture, small},
    prt_light::room,
    tracer_lab::{Stage, view},
};
use glam::{Mat4, Vec3, vec3};
use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    graph::Graph,
    passes::shadow,
    scene::{LightKind, Pose, Scene, View},
    technique::{Ready, Shot},
    techniques::prt::{Baked, Baking, Direct, Mode, PictureSettings, Prt, Stored},
};

fn few() -> Baking {
    Baking { samples: 1000, rays: 64, examples: 60, ..small() }
}

fn eye() -> View {
    view(vec3(1.6, 1.9, 1.2), vec3(-0.6, 0.7, -0.6), 75.0, [24, 18])
}

fn by(direct: Direct) -> PictureSettings {
    let mut settings = PictureSettings::default();
    settings.prt.direct = direct;
    settings
}

fn add_sun(stage: &mut Stage) {
    stage.light(LightKind::Directional, Vec3::ONE, 3.0, Mat4::from_rotation_x(-1.0));
}

#[test]
fn suns_are_off_and_the_strength_of_lights_counts_in_both_kinds_of_shadows() {
    with_gpu(|gpu| {
        let scene = room();
        let stored = baked(gpu, &scene, &Baking { samples: 1000, rays: 64, examples: 60, ..small() });
        let eye = view(vec3(1.6, 1.9, 1.2), vec3(-0.6, 0.7, -0.6), 75.0, [24, 18]);
        let mut with_sun = Stage { scene: room() };
        with_sun.light(LightKind::Directional, Vec3::ONE, 3.0, Mat4::from_rotation_x(-1.0));
        for direct in [Direct::Samples, Direct::Maps, Direct::Auto] {
            let mut settings = diffuse();
            settings.prt.direct = direct;
            let of = |scene: &Scene, settings: &PictureSettings| {
                let layers = picture(gpu, scene, &stored, &eye, settings, Mode::Total);
                ["direct", "indirect"].map(|name| layers.layer(name).unwrap().data.clone())
            };
            let once = of(&scene, &settings);
            assert_eq!(once, of(&with_sun.scene, &settings), "{direct:?}");
            settings.prt.strength = 2.0;
            for (once, twice) in once.iter().zip(of(&scene, &settings)) {
                let off = once.iter().zip(&twice).map(|(once, twice)| (2.0 * once - twice).abs()).fold(0.0, f32::max);
                assert!(off < 1e-2 && once.iter().any(|value| *value > 0.1), "{direct:?}: {off}");
            }
        }
    });
}

#[test]
fn shadow_maps_are_the_default_for_lights_that_have_some() {
    with_gpu(|gpu| {
        let stored = baked(gpu, &room(), &few());
        let of = |scene: &Scene, settings: &PictureSettings| {
            picture(gpu, scene, &stored, &eye(), settings, Mode::Total).layers
        };
        let [auto, maps, samples] = [Direct::Auto, Direct::Maps, Direct::Samples].map(by);
        let lit = |suns: usize, spots: usize, points: usize| {
            let mut stage = Stage { scene: Scene { lights: Vec::new(), ..room() } };
            stage.scene.nodes.retain(|node| node.light.is_none());
            (0..suns).for_each(|_| add_sun(&mut stage));
            let cone = LightKind::Spot { range: None, inner: 0.3, outer: 0.5 };
            let down =
                |i: usize| Mat4::from_translation(vec3(0.1 * i as f32 - 0.5, 2.2, 0.3)) * Mat4::from_rotation_x(-1.5);
            (0..spots).for_each(|i| stage.light(cone, Vec3::ONE, 2.0, down(i)));
            (0..points).for_each(|i| stage.point(vec3(0.1 * i as f32 - 0.5, 1.5, 0.3), Vec3::ONE));
            stage.scene
        };
        assert!(of(&lit(0, 0, 1), &maps) != of(&lit(0, 0, 1), &samples));
        // Suns need no maps; narrow spot lights need one each. Eleven point lights need 66.
        for scene in [lit(0, 0, 1), lit(2, 0, 10), lit(0, 20, 7)] {
            assert!(of(&scene, &auto) == of(&scene, &maps));
        }
        assert!(of(&lit(0, 0, 11), &auto) == of(&lit(0, 0, 11), &samples));
        // The light of suns alone is none.
        for scene in [lit(0, 0, 0), lit(1, 0, 0)] {
            assert!([&auto, &maps, &samples].iter().all(|settings| {
                let layers = picture(gpu, &scene, &stored, &eye(), settings, Mode::Total);
                ["direct", "indirect"].iter().all(|name| layers.layer(name).unwrap().data.iter().all(|v| *v == 0.0))
            }));
        }
        // A light with a radius is one with several points.
        let lamp = lit(0, 0, 1);
        let wide = |settings: &PictureSettings, points: u32| {
            let mut settings = settings.clone();
            (settings.prt.radius, settings.prt.points) = (0.1, points);
            of(&lamp, &settings)
        };
        assert!(wide(&auto, 1) == wide(&maps, 1) && wide(&auto, 4) == wide(&samples, 4));
        let without = |mut settings: PictureSettings| {
            settings.shadow.kind = shadow::Kind::Off;
            of(&lamp, &settings)
        };
        assert!(without(auto.clone()) == of(&lamp, &samples) && without(maps.clone()) != of(&lamp, &maps));
    });
}

/// The notes of a picture.
fn notes(gpu: &Gpu, stored: &Stored, settings: &PictureSettings) -> Vec<String> {
    let (scene, baked) = (room(), Baked::new(stored.clone()));
    let mut ready = Ready::<Prt>::new(gpu, &scene, settings, Some(&baked), &mut |_, _| true).unwrap();
    let mut graph = Graph::new("prt");
    let picture = ready.frame(&mut graph, (&scene, &Pose::rest(&scene)), &eye(), Shot::default(), settings).unwrap();
    picture.notes.iter().map(ToString::to_string).collect()
}

#[test]
fn settings_of_the_other_kind_of_shadows_are_named() {
    with_gpu(|gpu| {
        let stored = baked(gpu, &room(), &few());
        let named = |settings: &PictureSettings, part: &str| {
            let all = notes(gpu, &stored, settings);
            all.iter().any(|note| note.contains("has no effect") && note.contains(part))
        };
        for direct in [Direct::Auto, Direct::Maps, Direct::Samples] {
            let by_maps = direct != Direct::Samples;
            let mut settings = by(direct);
            assert!(notes(gpu, &stored, &settings).is_empty(), "{direct:?}");
            settings.prt.bias = 0.2;
            assert_eq!(named(&settings, "prt.bias"), by_maps, "{direct:?}");
            let mut settings = by(direct);
            settings.shadow.size = 256;
            assert_eq!(named(&settings, "shadow"), !by_maps, "{direct:?}");
        }
        // A radius alone leaves a light a point.
        let mut settings = by(Direct::Samples);
        settings.prt.radius = 0.1;
        assert!(named(&settings, "prt.radius"));
    });
}

#[test]
fn nine_lights_have_the_sum_of_their_light_also_on_glossy_surfaces() {
    with_gpu(|gpu| {
        let mut scene = room();
        scene.materials.iter_mut().for_each(|material| material.roughness = 0.3);
        let stored = baked(gpu, &scene, &few());
        let alone = Scene { lights: Vec::new(), ..scene.clone() };
        let with = |places: &[Vec3]| {
            let mut stage = Stage { scene: alone.clone() };
            stage.scene.nodes.retain(|node| node.light.is_none());
            places.iter().for_each(|at| stage.point(*at, Vec3::ONE));
            picture(gpu, &stage.scene, &stored, &eye(), &by(Direct::Samples), Mode::Total)
        };
        let places: Vec<Vec3> = (0..9).map(|i| vec3(0.2 * i as f32 - 1.0, 1.2 + 0.1 * i as f32, 0.4)).collect();
        let (all, each) = (with(&places), places.iter().map(|at| with(&[*at])).collect::<Vec<_>>());
        for name in ["direct", "indirect"] {
            let all = &all.layer(name).unwrap().data;
            let sum = |i: usize| each.iter().map(|of| of.layer(name).unwrap().data[i]).sum::<f32>();
            let (off, whole) = all
                .iter()
                .enumerate()
                .fold((0.0, 0.0), |(off, whole), (i, value)| (off + (value - sum(i)).abs(), whole + value));
            assert!(whole > 0.0 && off < 0.01 * whole, "{name}: {off} of {whole}");
        }
    });
}
