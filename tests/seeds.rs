//! The seed of a graph decides every random choice of a picture, and nothing else.

use crate::scene_kit;
use crate::scene_kit::{light, mesh, place, square};
use glam::{Mat4, Vec3};
use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    graph::{Graph, Image, Runner},
    passes::{ambient::Irradiance, gbuffer},
    resident::{Handles, Resident},
    scene::{AlphaMode, Environment, LightKind, Material, Pose, Scene, View},
    techniques::{
        fiv::{self, Fiv},
        igi::{self, Igi},
        isr,
    },
    tracer::{self, Filter, Tracer},
};

const EXTENT: [u32; 2] = [24, 18];

/// A floor under a lamp and an even sky, and between floor and lamp, above the view, a pane.
fn scene(pane: AlphaMode) -> Scene {
    let mut scene = Scene::default();
    let floor =
        mesh(&mut scene, square(), Material { double_sided: true, ..Material::diffuse("floor", Vec3::splat(0.5)) });
    place(&mut scene, floor, Mat4::from_scale(Vec3::splat(4.0)));
    let mut glass = Material { double_sided: true, alpha: pane, ..Material::diffuse("pane", Vec3::splat(0.8)) };
    glass.base_color.w = 0.5;
    let pane = mesh(&mut scene, square(), glass);
    place(&mut scene, pane, Mat4::from_translation(Vec3::new(0.0, 3.0, 0.0)));
    light(&mut scene, LightKind::Point { range: None }, Mat4::from_translation(Vec3::new(0.0, 4.0, 0.0)));
    scene.environment = Some(Environment::constant(Vec3::ONE));
    scene
}

/// On the floor below the pane.
fn floor_view() -> View {
    scene_kit::view(Vec3::new(0.0, 1.5, 1.5), Vec3::ZERO, EXTENT)
}

/// Through the pane, from above.
fn pane_view() -> View {
    scene_kit::view(Vec3::new(0.0, 3.5, 0.1), Vec3::ZERO, EXTENT)
}

/// The bytes of one picture for each seed, by everything that is made for one scene.
fn pictures(
    gpu: &Gpu,
    scene: &Scene,
    mut declare: impl FnMut(&mut Graph, &Handles, &Pose, &Resident) -> Image,
) -> [Vec<u8>; 3] {
    let pose = Pose::rest(scene);
    let mut resident = Resident::new(gpu, scene).unwrap();
    let mut runner = Runner::new(gpu);
    [0, 0, 7].map(|seed| {
        let mut graph = Graph::new("seeds");
        graph.seed = seed;
        let handles = resident.frame_in(&mut graph, scene, &pose);
        let image = declare(&mut graph, &handles, &pose, &resident);
        let token = graph.read_image(image);
        runner.run(&graph).unwrap_or_else(|error| panic!("{error}")).image(token).bytes.clone()
    })
}

/// The same seed gives the same bits; another one others exactly where something is `random`.
fn check(label: &str, [first, again, other]: [Vec<u8>; 3], random: bool) {
    assert!(first.iter().any(|byte| *byte != 0), "{label}: nothing is there");
    assert!(first == again, "{label}: the same seed gives other bits");
    assert_eq!(first != other, random, "{label}: whether another seed gives other bits");
}

const PANES: [(AlphaMode, bool); 3] =
    [(AlphaMode::Blend, true), (AlphaMode::Opaque, false), (AlphaMode::Mask { cutoff: 0.4 }, false)];

#[test]
fn what_a_pixel_shows_of_blended_surfaces_depends_on_the_seed() {
    with_gpu(|gpu| {
        for (alpha, random) in PANES {
            let scene = scene(alpha);
            let all = |blended| {
                pictures(gpu, &scene, |graph, handles, _, _| {
                    let settings = gbuffer::Settings { blended, ..Default::default() };
                    gbuffer::draw(graph, handles, &pane_view(), &settings).depth
                })
            };
            check("dithered", all(gbuffer::Blended::Dithered), random);
            check("threshold", all(gbuffer::Blended::Threshold), false);
            check("hidden", all(gbuffer::Blended::Hidden), false);
        }
    });
}

#[test]
fn image_space_radiosity_is_random_only_in_blended_surfaces() {
    with_gpu(|gpu| {
        for (alpha, random) in PANES {
            let scene = scene(alpha);
            let ambient = Irradiance::from(&scene);
            // Its samples lie on a lattice, not by chance. A blended pane that is not seen throws a dithered shadow.
            for (label, view) in [("pane", pane_view()), ("its shadow", floor_view())] {
                let settings = isr::PictureSettings::default();
                let all = pictures(gpu, &scene, |graph, handles, _, _| {
                    isr::picture(graph, handles, &view, ambient.clone(), &settings).unwrap().outputs.total
                });
                check(&format!("isr, {alpha:?}, {label}"), all, random);
            }
        }
    });
}

#[test]
fn vectors_by_brute_force_are_random_only_in_blended_surfaces() {
    with_gpu(|gpu| {
        for (alpha, random) in PANES {
            let mut scene = scene(alpha);
            // Its light comes from the environment alone.
            scene.lights.clear();
            scene.nodes.pop();
            let settings = fiv::Settings { method: fiv::Method::BruteForce, size: 16, ..Default::default() };
            let mut kept = None;
            let settings = fiv::PictureSettings { fiv: settings, ..Default::default() };
            let all = pictures(gpu, &scene, |graph, handles, pose, resident| {
                let fiv = kept
                    .get_or_insert_with(|| Fiv::new(gpu, &scene, resident, &settings.fiv, None, |_, _| true).unwrap());
                fiv.picture(graph, &scene, pose, handles, &floor_view(), &settings).unwrap().outputs.total
            });
            check(&format!("fiv, {alpha:?}"), all, random);
        }
    });
}

#[test]
fn instant_global_illumination_is_random_in_its_paths() {
    with_gpu(|gpu| {
        let scene = scene(AlphaMode::Opaque);
        for visibility in [igi::Visibility::Compute, igi::Visibility::Raster] {
            let settings = igi::Settings { vpls: 20, bounces: 1, visibility, ..Default::default() };
            let settings = igi::PictureSettings { igi: settings, ..Default::default() };
            let mut kept = None;
            let all = pictures(gpu, &scene, |graph, handles, pose, resident| {
                let igi = kept.get_or_insert_with(|| Igi::new(gpu, &scene, resident, &settings.igi).unwrap());
                igi.picture(graph, &scene, pose, handles, &floor_view(), &settings).unwrap().outputs.total
            });
            check(&format!("igi, {visibility:?}"), all, true);
        }
    });
}

#[test]
fn the_path_tracer_is_random_but_in_what_it_sees_directly() {
    with_gpu(|gpu| {
        for (alpha, random) in PANES {
            let scene = scene(alpha);
            let mut tracer = Tracer::new(gpu, &scene, &Pose::rest(&scene)).unwrap();
            let mut render = |seed: u32, bounces: u32| {
                let settings = tracer::Settings {
                    seed,
                    bounces,
                    filter: Filter::Centre,
                    diffuse_only: true,
                    ..Default::default()
                };
                tracer.render(&pane_view(), &settings, 1).unwrap()
            };
            let [a, b, c] = [0, 0, 7].map(|seed| render(seed, 2).layers);
            assert!(a == b && a != c, "{alpha:?}: paths");
            let [a, b, c] =
                [0, 0, 7].map(|seed| render(seed, 0).layers.into_iter().find(|layer| layer.name == "depth"));
            assert!(a.is_some() && a == b);
            assert_eq!(a != c, random, "{alpha:?}: the depth of what is seen");
        }
    });
}
