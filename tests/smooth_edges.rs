//! Smooth edges of one picture: against the mean of pictures at the same places, on surfaces that fill the picture, and what is refused.

use crate::tracer_lab::{Stage, flat_view, view};
use glam::{DVec3, Vec2, Vec3, vec3};
use lucerna::{
    gpu::{Gpu, ImageDesc, OwnedImage, Region, testing::with_gpu},
    graph::{Graph, Runner},
    passes::{
        edges::{self, PLACES},
        gbuffer, temporal,
    },
    resident::Resident,
    scene::{Material, Pose, Scene, View},
    technique::{Ready, Shot},
    techniques::isr::{AreaLights, Isr, Mode, PictureSettings, Settings},
};

const SIZE: [u32; 2] = [96, 72];

/// Places inside a pixel. The first one is the middle.
fn places() -> [Vec2; PLACES] {
    std::array::from_fn(|i| (temporal::place(i as u32) - 0.5).as_vec2())
}

/// A scene on the device.
struct Studio<'a> {
    scene: &'a Scene,
    ready: Ready<Isr>,
    runner: Runner,
}

fn settings() -> PictureSettings {
    let isr = Settings { area_lights: AreaLights::Image, ..Settings::default() };
    PictureSettings { isr, background: [0.4, 0.6, 1.0], ..PictureSettings::default() }
}

impl<'a> Studio<'a> {
    fn new(gpu: &Gpu, scene: &'a Scene) -> Self {
        let ready = Ready::new(gpu, scene, &settings(), None, &mut |_, _| true).unwrap();
        Self { scene, ready, runner: Runner::new(gpu) }
    }

    fn shoot(&mut self, view: &View, edges: Option<[Vec2; PLACES]>) -> Vec<DVec3> {
        let mut graph = Graph::new("studio");
        let shot = Shot { mode: Mode::Direct, edges, ..Shot::default() };
        let pose = Pose::rest(self.scene);
        let mut picture = self.ready.frame(&mut graph, (self.scene, &pose), view, shot, &settings()).unwrap();
        let mut total = None;
        picture.develop(|image| Ok(*total.insert(image))).unwrap();
        let token = graph.read_image(total.unwrap());
        let texels = self.runner.run(&graph).unwrap_or_else(|error| panic!("{error}")).image(token).to_f32();
        texels.iter().map(|texel| Vec3::from_slice(&texel[..3]).as_dvec3()).collect()
    }

    /// One picture, the same with smooth edges, and the mean of pictures at all places.
    fn three(&mut self, view: &View) -> [Vec<DVec3>; 3] {
        let one = self.shoot(view, None);
        let smooth = self.shoot(view, Some(places()));
        let mut mean = vec![DVec3::ZERO; one.len()];
        for place in places() {
            let there = self.shoot(&view.shifted(place), None);
            mean.iter_mut().zip(there).for_each(|(sum, light)| *sum += light / PLACES as f64);
        }
        [one, smooth, mean]
    }
}

fn off(a: DVec3, b: DVec3) -> f64 {
    (a - b).abs().max_element()
}

/// Sum of the differences relative to the light.
fn error(found: &[DVec3], right: &[DVec3]) -> f64 {
    let sum: f64 = found.iter().zip(right).map(|(a, b)| (*a - *b).abs().element_sum()).sum();
    sum / right.iter().map(|light| light.element_sum()).sum::<f64>()
}

fn eye() -> View {
    view(vec3(0.0, 1.0, 3.0), vec3(0.0, 1.0, 0.0), 50.0, SIZE)
}

/// Surfaces that emit and reflect nothing have the same light everywhere, so the light of a neighbour is that of the place, and the picture is
/// the mean of eight pictures. This holds for a card before a wall, a poster on the wall, and the sky beside it. The exception are places whose
/// surface no middle around shows: the corners of cards.
#[test]
fn cards_are_as_in_the_mean_of_pictures() {
    let mut stage = Stage::new();
    let [wall, card, poster] =
        [vec3(0.5, 0.6, 0.7), vec3(3.0, 1.0, 0.2), vec3(0.4, 0.6, 0.9)].map(|radiance| stage.emitter(radiance));
    stage.quad(wall, vec3(-1.4, -0.6, -1.0), vec3(2.3, 0.2, 0.0), vec3(-0.1, 3.0, 0.0));
    stage.quad(poster, vec3(-0.9, 1.2, -0.999), vec3(0.7, 0.13, 0.0), vec3(-0.1, 0.6, 0.0));
    stage.quad(card, vec3(-0.3, 0.2, 0.1), vec3(0.9, 0.37, 0.0), vec3(-0.37, 0.9, 0.0));
    with_gpu(|gpu| {
        let mut studio = Studio::new(gpu, &stage.scene);
        for eye in [eye(), flat_view(vec3(0.0, 1.0, 3.0), vec3(0.1, 1.0, 0.0), 3.0, SIZE)] {
            let [one, smooth, mean] = studio.three(&eye);
            let edges = one.iter().zip(&mean).filter(|(one, mean)| off(**one, **mean) > 1e-3).count();
            let wrong = smooth.iter().zip(&mean).filter(|(smooth, mean)| off(**smooth, **mean) > 1e-3).count();
            assert!(edges > 250, "{edges}");
            assert!(wrong * 25 < edges, "{wrong} of {edges}");
            let [before, after] = [&one, &smooth].map(|found| error(found, &mean));
            assert!(after < 0.03 * before, "{after} {before}");
            // The sky looks as the environment does behind the wall's edge, and nothing is brighter than the card.
            assert!(smooth.iter().all(|light| light.x <= 3.001 && light.x >= 0.399));
        }
    });
}

/// A floor towards the horizon, and the inside of a sphere, which has another normal in each pixel.
#[test]
fn a_surface_that_fills_the_picture_stays_as_it_is() {
    for round in [false, true] {
        let mut stage = Stage::new();
        let matt = stage.material(Material { ior: 1.0, ..Material::diffuse("matt", Vec3::splat(0.6)) });
        if round {
            stage.sphere(matt, vec3(0.0, 1.0, 0.0), 4.0, 48, true);
        } else {
            stage.quad(matt, vec3(-400.0, 0.0, -400.0), vec3(0.0, 0.0, 800.0), vec3(800.0, 0.0, 0.0));
        }
        stage.point(vec3(0.4, 1.7, 0.3), Vec3::splat(9.0));
        let eye = view(vec3(0.0, 1.0, 3.0), vec3(0.0, if round { 1.0 } else { 0.35 }, 0.0), 20.0, SIZE);
        with_gpu(|gpu| {
            let mut studio = Studio::new(gpu, &stage.scene);
            let [one, smooth] = [None, Some(places())].map(|edges| studio.shoot(&eye, edges));
            for (i, (one, smooth)) in one.iter().zip(&smooth).enumerate() {
                assert!(off(*one, *smooth) <= 1e-6 * one.max_element(), "pixel {i}, round {round}: {one} {smooth}");
            }
        });
    }
}

/// Lit surfaces of one colour before each other. Shadows keep their edges, and a rail of a fifth of a pixel is seen where middles of pixels meet it.
#[test]
fn lit_surfaces_are_nearer_to_the_mean_of_pictures() {
    let mut stage = Stage::new();
    let white = stage.material(Material { ior: 1.0, ..Material::diffuse("white", Vec3::splat(0.7)) });
    stage.quad(white, vec3(-4.0, 0.0, -2.0), vec3(0.0, 0.0, 6.0), vec3(8.0, 0.0, 0.0));
    stage.quad(white, vec3(-4.0, 0.0, -2.0), vec3(8.0, 0.0, 0.0), vec3(0.0, 1.6, 0.0));
    stage.cuboid(white, vec3(-0.9, 0.0, -0.7), vec3(-0.3, 0.9, -0.1), false);
    stage.sphere(white, vec3(0.6, 0.5, 0.0), 0.5, 24, false);
    stage.quad(white, vec3(-1.5, 0.8, -1.5), vec3(3.0, 0.4, 0.0), vec3(0.0, 0.006, 0.0));
    stage.point(vec3(0.9, 2.5, 2.0), Vec3::splat(30.0));
    with_gpu(|gpu| {
        let mut studio = Studio::new(gpu, &stage.scene);
        let [one, smooth, mean] = studio.three(&eye());
        let [before, after] = [&one, &smooth].map(|found| error(found, &mean));
        println!("error relative to the mean of {PLACES} pictures: {before} of one picture, {after} with smooth edges");
        // Where the planes of two sides of a box meet, only their normals tell them apart; without normals this is 0.49.
        assert!(after < 0.46 * before, "{after} {before}");
        let sums = [&smooth, &mean].map(|picture| picture.iter().map(|light| light.element_sum()).sum::<f64>());
        assert!((sums[0] / sums[1] - 1.0).abs() < 2e-3, "{sums:?}");
        assert!(studio.shoot(&eye(), Some(places())) == smooth);
    });
}

/// A sheet lies on a table of another colour, in the same plane and with the same normal.
#[test]
fn colours_tell_surfaces_apart() {
    let mut stage = Stage::new();
    let of = |colour| Material { ior: 1.0, ..Material::diffuse("matt", colour) };
    let [table, sheet] = [vec3(0.4, 0.2, 0.1), vec3(0.8, 0.8, 0.7)].map(|colour| stage.material(of(colour)));
    stage.quad(table, vec3(-9.0, 0.0, -9.0), vec3(0.0, 0.0, 18.0), vec3(18.0, 0.0, 0.0));
    stage.quad(sheet, vec3(-0.5, 0.002, 0.2), vec3(0.1, 0.0, 0.9), vec3(0.9, 0.0, -0.1));
    stage.point(vec3(0.5, 6.0, 2.0), Vec3::splat(90.0));
    with_gpu(|gpu| {
        let [one, smooth, mean] = Studio::new(gpu, &stage.scene).three(&eye());
        let [before, after] = [&one, &smooth].map(|found| error(found, &mean));
        println!("error relative to the mean of {PLACES} pictures: {before} of one picture, {after} with smooth edges");
        // The edge of the table against the sky is most of the error of one picture.
        assert!(after < 0.05 * before, "{after} {before}");
    });
}

/// `light` with smooth edges, one texel for each pixel of `view`.
fn smoothed(gpu: &Gpu, scene: &Scene, view: &View, light: &[[f32; 4]]) -> Vec<f32> {
    let desc = ImageDesc::new(ash::vk::Format::R32G32B32A32_SFLOAT, view.extent[0], view.extent[1]);
    let region = Region { mip: 0, layer: 0, bytes: bytemuck::cast_slice(light) };
    let image = OwnedImage::with_contents(gpu, "light", desc, &[region]).unwrap();
    let mut resident = Resident::new(gpu, scene).unwrap();
    let mut graph = Graph::new("smoothed");
    let handles = resident.frame_in(&mut graph, scene, &Pose::rest(scene));
    let view = view.fit_far(&handles.bounds());
    let g = gbuffer::draw(&mut graph, &handles, &view, &gbuffer::Settings::default());
    let light = graph.import_image(&image);
    let weights = edges::weights(&mut graph, &handles, (&g, &view), &places()).unwrap();
    let token = weights.smooth(&mut graph, light).unwrap();
    let token = graph.read_image(token);
    let frame = Runner::new(gpu).run(&graph).unwrap_or_else(|error| panic!("{error}"));
    frame.image(token).to_f32().iter().map(|texel| texel[0]).collect()
}

/// A picture with light that is infinite or no number, on a card before a wall.
#[test]
fn light_that_is_no_number_stays_on_its_surface() {
    let mut stage = Stage::new();
    let [wall, card] = [vec3(0.5, 0.6, 0.7), vec3(3.0, 1.0, 0.2)].map(|radiance| stage.emitter(radiance));
    stage.quad(wall, vec3(-9.0, -9.0, -1.0), vec3(18.0, 0.0, 0.0), vec3(0.0, 18.0, 0.0));
    stage.quad(card, vec3(-0.3, 0.2, 0.1), vec3(0.9, 0.37, 0.0), vec3(-0.37, 0.9, 0.0));
    with_gpu(|gpu| {
        let shown = Studio::new(gpu, &stage.scene).shoot(&eye(), None);
        let on_card: Vec<bool> = shown.iter().map(|light| light.x > 1.0).collect();
        let of_card = |value: f32, other: f32| -> Vec<[f32; 4]> {
            on_card.iter().map(|card| [if *card { value } else { other }; 4]).collect()
        };
        let share = smoothed(gpu, &stage.scene, &eye(), &of_card(1.0, 0.0));
        for bad in [f32::NAN, f32::INFINITY] {
            let found = smoothed(gpu, &stage.scene, &eye(), &of_card(bad, 0.25));
            for (i, (found, share)) in found.iter().zip(&share).enumerate() {
                assert_eq!(found.is_finite(), *share == 0.0, "pixel {i}: {found}, share {share}");
                assert!(!found.is_finite() || (found - 0.25).abs() < 1e-6, "pixel {i}: {found}");
            }
        }
        // Pixels beside the card without a share of its light.
        let width = SIZE[0] as usize;
        let beside = |i: usize| on_card[i - 1] || on_card[i + 1] || on_card[i - width] || on_card[i + width];
        let inner = width + 1..on_card.len() - width - 1;
        let alone = inner.filter(|i| !on_card[*i] && beside(*i) && share[*i] == 0.0).count();
        let shared = share.iter().filter(|share| **share > 0.0 && **share < 1.0).count();
        assert!(alone > 20 && shared > 50, "{alone} {shared}");
    });
}

#[test]
fn layers_add_up_to_the_picture() {
    let mut stage = Stage::new();
    let of = |colour| Material { ior: 1.0, ..Material::diffuse("matt", colour) };
    let [white, red] = [vec3(0.7, 0.7, 0.7), vec3(0.8, 0.2, 0.1)].map(|colour| stage.material(of(colour)));
    stage.quad(white, vec3(-4.0, 0.0, -2.0), vec3(0.0, 0.0, 6.0), vec3(8.0, 0.0, 0.0));
    stage.quad(white, vec3(-9.0, -9.0, -2.0), vec3(18.0, 0.0, 0.0), vec3(0.0, 18.0, 0.0));
    stage.cuboid(red, vec3(-0.9, 0.0, -0.7), vec3(-0.3, 0.9, -0.1), false);
    stage.sphere(white, vec3(0.6, 0.5, 0.0), 0.5, 24, false);
    stage.point(vec3(0.9, 2.5, 2.0), Vec3::splat(30.0));
    with_gpu(|gpu| {
        let mut studio = Studio::new(gpu, &stage.scene);
        let pose = Pose::rest(&stage.scene);
        let [plain, smooth] = [None, Some(places())].map(|edges| {
            let mut graph = Graph::new("layers");
            let shot = Shot { edges, ..Shot::default() };
            let picture = studio.ready.frame(&mut graph, (&stage.scene, &pose), &eye(), shot, &settings()).unwrap();
            let reading = picture.read(&mut graph, true, false);
            let frame = studio.runner.run(&graph).unwrap_or_else(|error| panic!("{error}"));
            reading.layers(&frame)
        });
        let data = |name: &str| smooth.layer(name).unwrap_or_else(|| panic!("no layer {name}")).data.clone();
        let (total, direct, indirect) = (data(""), data("direct"), data("indirect"));
        assert!(indirect.iter().any(|value| *value > 0.0));
        // The technique rounds each of the three to 16 bits.
        for (total, (direct, indirect)) in total.iter().zip(direct.iter().zip(&indirect)) {
            assert!((total - direct - indirect).abs() <= 1.5e-3 * total + 1e-5, "{total} {direct} {indirect}");
        }
        for layer in &plain.layers {
            let same = layer.data == data(&layer.name);
            assert_eq!(same, layer.channels != ["R", "G", "B"], "{}", layer.name);
        }
    });
}

#[test]
fn a_picture_that_is_no_light_is_refused() {
    with_gpu(|gpu| {
        let mut stage = Stage::new();
        let white = stage.material(Material::diffuse("white", Vec3::splat(0.7)));
        stage.quad(white, vec3(-1.0, 0.0, -1.0), vec3(2.0, 0.0, 0.0), vec3(0.0, 2.0, 0.0));
        let mut studio = Studio::new(gpu, &stage.scene);
        let shot = Shot { mode: Mode::Occlusion, edges: Some(places()), ..Shot::default() };
        let pose = Pose::rest(&stage.scene);
        let result = studio.ready.frame(&mut Graph::new("studio"), (&stage.scene, &pose), &eye(), shot, &settings());
        let error = result.unwrap_err();
        assert!(error.exit_code() == 2 && error.to_string().contains("occlusion"), "{error}");
    });
}
