//! Temporal anti-aliasing in sequences: the mean of light at rest, what keeps its average and what must not, and when there is no past.

use crate::tracer_lab::{Stage, view};
use glam::{DVec3, Mat4, Vec2, Vec3, vec3};
use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    graph::{Graph, Runner},
    passes::temporal,
    scene::{Material, Pose, Scene, View},
    technique::{Ready, Shot, Technique},
    techniques::isr::{AreaLights, Isr, Mode, PictureSettings, Settings},
};

type Texels = Vec<[f32; 4]>;

const SIZE: [u32; 2] = [64, 48];

/// A scene on the device, rendered as a sequence of frames.
struct Film<'a> {
    scene: &'a Scene,
    ready: Ready<Isr>,
    runner: Runner,
    settings: PictureSettings,
    temporal: Option<temporal::Settings>,
    frame: u32,
    repeats: u32,
}

fn settings() -> PictureSettings {
    let isr = Settings { area_lights: AreaLights::Image, ..Settings::default() };
    PictureSettings { isr, background: [0.4, 0.6, 1.0], ..PictureSettings::default() }
}

impl<'a> Film<'a> {
    fn new(gpu: &Gpu, scene: &'a Scene, frames: Option<u32>) -> Self {
        let settings = settings();
        let ready = Ready::new(gpu, scene, &settings, None, &mut |_, _| true).unwrap();
        let temporal = frames.map(|frames| temporal::Settings { frames });
        Self { scene, ready, runner: Runner::new(gpu), settings, temporal, frame: 0, repeats: 0 }
    }

    /// The picture of the next frame; alpha: its number of averaged frames.
    fn shoot(&mut self, pose: &Pose, view: &View) -> Texels {
        let place = (temporal::place(self.frame) - 0.5).as_vec2();
        let shift = if self.temporal.is_some() { place } else { Vec2::ZERO };
        self.frame += 1;
        self.shown(self.frame - 1, pose, &view.shifted(shift))
    }

    fn shown(&mut self, frame: u32, pose: &Pose, view: &View) -> Texels {
        let mut graph = Graph::new("film");
        graph.frame = frame;
        let shot = Shot { temporal: self.temporal, ..Shot::default() };
        let mut picture = self.ready.frame(&mut graph, (self.scene, pose), view, shot, &self.settings).unwrap();
        if self.temporal.is_some() {
            assert_eq!(picture.view.unwrap().shift(), Vec2::ZERO);
        }
        let mut total = None;
        picture.develop(|image| Ok(*total.insert(image))).unwrap();
        let token = graph.read_image(total.unwrap());
        // The same frame may run several times.
        for _ in 0..self.repeats {
            self.runner.run_held(&graph).unwrap();
        }
        self.runner.run(&graph).unwrap_or_else(|error| panic!("{error}")).image(token).to_f32()
    }

    /// The mean of pictures that look at the places of these frames.
    fn truth(&mut self, pose: &Pose, view: &View, frames: u32) -> Vec<DVec3> {
        assert!(self.temporal.is_none());
        let mut sum = vec![DVec3::ZERO; (SIZE[0] * SIZE[1]) as usize];
        for frame in 0..frames {
            let shifted = view.shifted((temporal::place(frame) - 0.5).as_vec2());
            let picture = self.shown(0, pose, &shifted);
            sum.iter_mut().zip(&picture).for_each(|(sum, texel)| *sum += light(texel) / f64::from(frames));
        }
        sum
    }
}

fn light(texel: &[f32; 4]) -> DVec3 {
    Vec3::from_slice(&texel[..3]).as_dvec3()
}

/// Sum of the absolute differences over the pixels that `of` selects, relative to the sum of the light of `right`.
fn error(found: &Texels, right: &[DVec3], of: impl Fn(usize) -> bool) -> f64 {
    let chosen: Vec<usize> = (0..right.len()).filter(|&i| of(i)).collect();
    let off: f64 = chosen.iter().map(|&i| (light(&found[i]) - right[i]).abs().element_sum()).sum();
    let all: f64 = chosen.iter().map(|&i| right[i].element_sum()).sum();
    assert!(all > 0.0, "{} pixels", chosen.len());
    off / all
}

/// A court under a lamp: a floor and a wall with sky above, thin bars before the wall, and a block. Also returns the node of the block.
fn court() -> (Scene, usize) {
    let mut stage = Stage::new();
    let white = stage.material(Material::diffuse("white", vec3(0.7, 0.7, 0.65)));
    let dark = stage.material(Material::diffuse("dark", vec3(0.03, 0.03, 0.03)));
    let red = stage.material(Material::diffuse("red", vec3(0.7, 0.1, 0.05)));
    stage.quad(white, vec3(-4.0, 0.0, -2.0), vec3(0.0, 0.0, 6.0), vec3(8.0, 0.0, 0.0));
    stage.quad(white, vec3(-4.0, 0.0, -2.0), vec3(8.0, 0.0, 0.0), vec3(0.0, 1.6, 0.0));
    // Bars of about a fifth of a pixel.
    for i in 0..9 {
        let x = -1.6 + 0.41 * i as f32;
        stage.quad(dark, vec3(x, 0.3, -1.5), vec3(0.012, 0.0, 0.0), vec3(0.06, 1.2, 0.0));
    }
    let block = stage.quad(red, vec3(-0.4, 0.1, -0.6), vec3(0.6, 0.0, 0.0), vec3(0.0, 1.1, 0.0));
    stage.point(vec3(0.5, 2.5, 2.0), Vec3::splat(30.0));
    (stage.scene, block)
}

fn eye() -> View {
    view(vec3(0.0, 1.0, 2.4), vec3(0.0, 0.75, -2.0), 50.0, SIZE)
}

#[test]
fn a_rest_becomes_the_mean_of_its_pictures_and_keeps_the_light() {
    with_gpu(|gpu| {
        let (scene, _) = court();
        let pose = Pose::rest(&scene);
        let right = Film::new(gpu, &scene, None).truth(&pose, &eye(), 64);
        let sum = |picture: &Texels| picture.iter().map(|texel| light(texel).element_sum()).sum::<f64>();
        let all: f64 = right.iter().map(|c| c.element_sum()).sum();
        let first = error(&Film::new(gpu, &scene, None).shoot(&pose, &eye()), &right, |_| true);
        for (frames, most) in [(64, 0.3), (8, 0.6)] {
            let mut film = Film::new(gpu, &scene, Some(frames));
            let shots: Vec<Texels> = (0..64).map(|_| film.shoot(&pose, &eye())).collect();
            let last = error(&shots[63], &right, |_| true);
            // Over some frames, because each looks at other places.
            let kept = shots[40..].iter().map(sum).sum::<f64>() / (24.0 * all) - 1.0;
            println!("at rest, {frames} frames: {first} → {last}, light {kept:+.5}");
            assert!(last < most * first, "{first} {last}");
            assert!(kept.abs() < 5e-3, "{kept}");
            let counts = shots[63].iter().filter(|texel| texel[3] > 0.9 * frames as f32).count();
            println!("{counts} pixels have all frames");
            assert!(counts as f64 > 0.7 * f64::from(SIZE[0] * SIZE[1]), "{counts} pixels have all frames");
        }
    });
}

/// The block moves to the right by about two pixels a frame.
fn walked(scene: &Scene, block: usize, frame: u32) -> Pose {
    let mut pose = Pose::rest(scene);
    pose.world[block] = Mat4::from_translation(vec3(-0.8 + 0.1 * frame as f32, 0.0, 0.0));
    pose
}

#[test]
fn what_moves_keeps_its_average_and_leaves_no_ghost() {
    with_gpu(|gpu| {
        let (scene, block) = court();
        let mut film = Film::new(gpu, &scene, Some(8));
        let mut single = Film::new(gpu, &scene, None);
        let frames = 12;
        let shots: Vec<Texels> = (0..frames).map(|i| film.shoot(&walked(&scene, block, i), &eye())).collect();
        let truths: Vec<Vec<DVec3>> =
            [frames - 4, frames - 1].map(|i| single.truth(&walked(&scene, block, i), &eye(), 32)).into();
        // The red block has no green.
        let is_block = |c: &DVec3| c.x > 4.0 * c.y;
        let [before, now] = [&truths[0], &truths[1]];
        let last = &shots[frames as usize - 1];
        let left = |i: usize| is_block(&before[i]) && !is_block(&now[i]) && now[i].x < 2.0 * now[i].y;
        let uncovered = (0..now.len()).filter(|&i| left(i)).count();
        let ghost = error(last, now, left);
        let unfiltered = single.shown(0, &walked(&scene, block, frames - 1), &eye());
        let without = error(&unfiltered, now, left);
        // What the test would find if the average of three frames ago were still there.
        let stale = error(&shots[frames as usize - 4], now, left);
        println!("{uncovered} pixels uncovered: error {ghost}, {without} without anti-aliasing, {stale} of a ghost");
        assert!(uncovered > 60 && stale > 0.3, "{uncovered} {stale}");
        assert!(ghost < 1.5 * without + 0.02 && ghost < 0.2 * stale, "{ghost} {without} {stale}");
        // Inside of the block there is an average, although it crosses two pixels a frame. Its light changes, so that fewer frames count.
        let width = SIZE[0] as usize;
        let inside = |i: usize| {
            [0, 1, 2, width, 2 * width]
                .iter()
                .all(|off| is_block(&now[(i + off).saturating_sub(1 + width).min(now.len() - 1)]))
        };
        let counts: Vec<f32> = (0..now.len()).filter(|&i| inside(i)).map(|i| last[i][3]).collect();
        let whole = counts.iter().filter(|count| **count > 2.5).count();
        println!("{whole} of {} pixels of the block have an average", counts.len());
        assert!(counts.len() > 60 && whole as f64 > 0.8 * counts.len() as f64, "{counts:?}");
    });
}

#[test]
fn a_turning_camera_keeps_surfaces_and_sky() {
    with_gpu(|gpu| {
        let (scene, _) = court();
        let pose = Pose::rest(&scene);
        let turned = |i: u32| {
            let angle = 0.013 * i as f32;
            view(vec3(0.0, 1.0, 2.4), vec3(4.4 * angle.sin(), 0.75, 2.4 - 4.4 * angle.cos()), 50.0, SIZE)
        };
        let mut film = Film::new(gpu, &scene, Some(8));
        let last = (0..12).map(|i| film.shoot(&pose, &turned(i))).last().unwrap();
        let right = Film::new(gpu, &scene, None).truth(&pose, &turned(11), 32);
        // The background is bluer than everything else.
        let sky = |i: usize| right[i].z > 2.0 * right[i].x;
        for (name, of) in [("sky", true), ("surfaces", false)] {
            let chosen: Vec<usize> = (0..right.len()).filter(|&i| sky(i) == of && i % 64 < 50).collect();
            let whole = chosen.iter().filter(|&&i| last[i][3] > 3.0).count() as f64 / chosen.len() as f64;
            println!("{name}: {} pixels, {whole} have an average", chosen.len());
            assert!(chosen.len() > 200 && whole > 0.6, "{name}: {whole}");
        }
        let single = Film::new(gpu, &scene, None).shoot(&pose, &turned(11));
        let errors = [&last, &single].map(|picture| error(picture, &right, |i| i % 64 < 50));
        println!("error of a turning camera: {errors:?}");
        assert!(errors[0] < 0.8 * errors[1], "{errors:?}");
    });
}

#[test]
fn first_frames_and_cuts_and_gaps_stand_for_themselves() {
    with_gpu(|gpu| {
        let (scene, block) = court();
        let pose = walked(&scene, block, 3);
        let single = |frame: u32, view: &View| {
            let shift = (temporal::place(frame) - 0.5).as_vec2();
            Film::new(gpu, &scene, None).shown(frame, &pose, &view.shifted(shift))
        };
        #[track_caller]
        fn alone(found: &Texels, right: &Texels) {
            assert!(found.iter().zip(right).all(|(f, r)| f[..3] == r[..3] && f[3] == 1.0));
        }
        let seen = eye();
        let mut film = Film::new(gpu, &scene, Some(8));
        alone(&film.shoot(&pose, &seen), &single(0, &seen));
        let second = film.shoot(&pose, &seen);
        assert!(second.iter().filter(|texel| texel[3] > 1.5).count() as f64 > 0.9 * second.len() as f64);
        // After a skipped frame, after `forget_history` and after a change of size there is no past.
        film.frame += 1;
        alone(&film.shoot(&pose, &seen), &single(3, &seen));
        film.shoot(&pose, &seen);
        film.runner.forget_history();
        alone(&film.shoot(&pose, &seen), &single(5, &seen));
        let small = view(vec3(0.0, 1.0, 2.4), vec3(0.0, 0.75, -2.0), 50.0, [40, 30]);
        alone(&film.shoot(&pose, &small), &single(6, &small));
        // After a cut to the floor before the camera, too.
        let down = view(vec3(0.0, 1.0, 3.4), vec3(0.0, 0.0, 3.2), 40.0, [40, 30]);
        alone(&film.shoot(&pose, &down), &single(7, &down));
        // Rendering the film again gives the same bits, also if its frames run several times.
        let again = |repeats| {
            let mut film = Film { repeats, ..Film::new(gpu, &scene, Some(8)) };
            (0..4).map(|i| film.shoot(&walked(&scene, block, i), &seen)).collect::<Vec<_>>()
        };
        assert!(again(0) == again(0) && again(0) == again(2));
    });
}

#[test]
fn pictures_that_are_no_light_are_refused() {
    with_gpu(|gpu| {
        let (scene, _) = court();
        let mut film = Film::new(gpu, &scene, Some(8));
        let mut frame = |mode, frames| {
            let shot = Shot { mode, temporal: Some(temporal::Settings { frames }), ..Shot::default() };
            let pose = Pose::rest(&scene);
            film.ready.frame(&mut Graph::new("film"), (&scene, &pose), &eye(), shot, &film.settings)
        };
        let error = frame(Mode::Occlusion, 8).unwrap_err();
        assert!(error.exit_code() == 2 && error.to_string().contains("occlusion"), "{error}");
        assert_eq!(frame(Mode::Isr, 0).unwrap_err().exit_code(), 2);
        for mode in [Mode::Isr, Mode::Direct, Mode::Indirect] {
            assert!(frame(mode, 8).is_ok());
        }
        assert_eq!(Isr::NAME, "isr");
    });
}
