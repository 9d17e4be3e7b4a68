//! Instant global illumination over time: the gain of the history while the scene rests, its error while objects move, and the cases in which
//! it must be discarded.

use crate::igi_lab::plain;
use crate::tracer_lab::{Stage, view};
use glam::{Mat4, Vec3, vec3};
use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    graph::{Graph, Runner},
    passes::motion,
    resident::Resident,
    scene::{Material, Pose, Scene, View},
    techniques::igi::{Igi, PictureSettings, Settings},
};
use lucerna_scenes as builtin;

type Texels = Vec<[f32; 4]>;

/// A scene on the device, rendered as a sequence of frames.
struct Film<'a> {
    scene: &'a Scene,
    resident: Resident,
    igi: Igi,
    runner: Runner,
    settings: Settings,
    frame: u32,
    repeats: u32,
}

/// One frame of a film.
struct Shot {
    /// Alpha: the number of averaged frames, with a history.
    irradiance: Texels,
    /// Linear depth / far; 1: background.
    depth: Vec<f32>,
    total: Vec<u8>,
}

impl<'a> Film<'a> {
    fn new(gpu: &Gpu, scene: &'a Scene, settings: &Settings) -> Self {
        let resident = Resident::new(gpu, scene).unwrap();
        let igi = Igi::new(gpu, scene, &resident, settings).unwrap();
        Self { scene, resident, igi, runner: Runner::new(gpu), settings: settings.clone(), frame: 0, repeats: 0 }
    }

    /// The next frame.
    fn shoot(&mut self, pose: &Pose, view: &View) -> Shot {
        let mut graph = Graph::new("film");
        graph.frame = self.frame;
        self.frame += 1;
        let handles = self.resident.frame_in(&mut graph, self.scene, pose);
        let all = PictureSettings { igi: self.settings.clone(), ..Default::default() };
        let view = view.fit_far(&handles.bounds());
        let picture = self.igi.picture(&mut graph, self.scene, pose, &handles, &view, &all).unwrap();
        let tokens = [picture.outputs.irradiance, picture.gbuffer.depth, picture.outputs.total];
        let [irradiance, depth, total] = tokens.map(|image| graph.read_image(image));
        // The same frame may run several times.
        for _ in 0..self.repeats {
            self.runner.run_held(&graph).unwrap();
        }
        let frame = self.runner.run(&graph).unwrap_or_else(|error| panic!("{error}"));
        Shot {
            irradiance: frame.image(irradiance).to_f32(),
            depth: frame.image(depth).to_f32().iter().map(|t| t[0]).collect(),
            total: frame.image(total).bytes,
        }
    }
}

/// A room with a lamp, and with a block in its middle that casts shadows. Also returns the nodes of block and lamp.
fn room() -> (Scene, usize, usize) {
    let mut stage = Stage::new();
    let wall = stage.material(Material::diffuse("wall", vec3(0.7, 0.6, 0.5)));
    let red = stage.material(Material::diffuse("red", vec3(0.7, 0.2, 0.1)));
    stage.cuboid(wall, Vec3::splat(-1.0), Vec3::ONE, true);
    // The block is one mesh without a bottom; the floor closes it.
    let block = block(&mut stage, red, vec3(-0.3, -0.6, -0.3), vec3(0.3, 0.0, 0.3));
    stage.point(vec3(0.3, 0.7, 0.2), vec3(2.0, 1.8, 1.5));
    let lamp = stage.scene.nodes.len() - 1;
    (stage.scene, block, lamp)
}

/// A box of one mesh, seen from the outside.
fn block(stage: &mut Stage, material: u32, low: Vec3, high: Vec3) -> usize {
    let (mut positions, mut normals, mut indices) = (Vec::new(), Vec::new(), Vec::new());
    for axis in 0..3 {
        for (side, n) in [(low[axis], -1.0f32), (high[axis], 1.0)] {
            let first = positions.len() as u32;
            for (u, v) in [(0, 0), (1, 0), (1, 1), (0, 1)] {
                let mut p = Vec3::ZERO;
                (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) =
                    (side, [low, high][u][(axis + 1) % 3], [low, high][v][(axis + 2) % 3]);
                positions.push(p);
                let mut normal = Vec3::ZERO;
                normal[axis] = n;
                normals.push(normal);
            }
            let quad = if n > 0.0 { [0, 1, 2, 0, 2, 3] } else { [0, 2, 1, 0, 3, 2] };
            indices.extend(quad.map(|i| first + i));
        }
    }
    stage.mesh(material, positions, normals, indices)
}

fn eye(extent: [u32; 2]) -> View {
    view(vec3(0.2, 0.1, 0.95), vec3(-0.05, -0.35, -0.6), 75.0, extent)
}

const SMALL: [u32; 2] = [48, 36];
/// Size of films.
const TINY: [u32; 2] = [32, 24];

fn brightness(texel: &[f32; 4]) -> f64 {
    f64::from(texel[0]) + f64::from(texel[1]) + f64::from(texel[2])
}

/// Root mean square difference, relative to the mean of `right`, over the pixels that `of` selects.
fn error(found: &Texels, right: &Texels, of: impl Fn(usize) -> bool) -> f64 {
    let (mut sum, mut all, mut count) = (0.0, 0.0, 0.0);
    for i in (0..right.len()).filter(|&i| of(i)) {
        sum += (brightness(&found[i]) - brightness(&right[i])).powi(2);
        all += brightness(&right[i]);
        count += 1.0;
    }
    assert!(count > 0.0 && all > 0.0);
    (sum / count).sqrt() / (all / count)
}

fn with_history(settings: Settings, history: u32) -> Settings {
    Settings { history, ..settings }
}

#[test]
fn a_rest_of_many_frames_is_one_frame_of_all_their_virtual_lights() {
    with_gpu(|gpu| {
        let (scene, ..) = room();
        let pose = Pose::rest(&scene);
        let seen = eye(SMALL);
        // This number of paths has no common factor with the bases of the sequence, so no points are skipped between frames.
        let (each, frames) = (23, 16);
        let base = Settings { bounces: 2, ..plain(2 * each) };
        let mut film = Film::new(gpu, &scene, &with_history(base.clone(), frames));
        let shots: Vec<Shot> = (0..frames).map(|_| film.shoot(&pose, &seen)).collect();
        let all = Film::new(gpu, &scene, &Settings { vpls: 2 * each * frames, ..base.clone() }).shoot(&pose, &seen);
        // The paths of all frames together are those of the single frame: the same points of the sequence, with the same flux.
        let last = &shots[frames as usize - 1].irradiance;
        for (i, (found, right)) in last.iter().zip(&all.irradiance).enumerate() {
            assert!((found[3] - frames as f32).abs() < 0.01, "pixel {i} counts {} frames", found[3]);
            for c in 0..3 {
                let off = (found[c] - right[c]).abs();
                assert!(off <= 2e-3 * right[c] + 1e-5, "pixel {i}: {found:?} instead of {right:?}");
            }
        }
        let alone = error(&shots[0].irradiance, &all.irradiance, |_| true);
        assert!(alone > 0.05, "a frame alone is as good: {alone}");
        // With importance resampling the frames have other virtual lights, but the error falls as well.
        let seen = eye(TINY);
        // (With a bound, because a virtual light next to a pixel would dominate the error.)
        let base = Settings { candidates: 4, bound: 0.05, ..base };
        let mut film = Film::new(gpu, &scene, &with_history(base.clone(), 100));
        let shots: Vec<Shot> = (0..16).map(|_| film.shoot(&pose, &seen)).collect();
        let right = Film::new(gpu, &scene, &Settings { vpls: 4000, candidates: 1, ..base }).shoot(&pose, &seen);
        let errors = [0, 15].map(|i: usize| error(&shots[i].irradiance, &right.irradiance, |_| true));
        println!("at rest: {errors:?}");
        assert!(errors[1] < 0.4 * errors[0], "{errors:?}");
    });
}

#[test]
fn first_frames_and_cuts_and_gaps_stand_for_themselves() {
    with_gpu(|gpu| {
        let (scene, ..) = room();
        let pose = Pose::rest(&scene);
        let seen = eye(SMALL);
        let base = Settings { specular: false, direct_samples: 1, bounces: 2, vpls: 24, ..Settings::default() };
        let single = |frame: u32, view: &View| {
            let mut film = Film::new(gpu, &scene, &with_history(base.clone(), 1));
            film.frame = frame;
            film.shoot(&pose, view).total
        };
        let mut film = Film::new(gpu, &scene, &with_history(base.clone(), 16));
        // The first frame is the same as without a history.
        let first = film.shoot(&pose, &seen).total;
        assert_eq!(first, Film::new(gpu, &scene, &base).shoot(&pose, &seen).total);
        // The second frame differs from the same frame without a history.
        assert_ne!(film.shoot(&pose, &seen).total, single(1, &seen));
        // After a cut to the wall behind the camera the history does not count.
        let back = view(vec3(0.2, 0.1, 0.5), vec3(0.3, 0.2, 0.9), 60.0, SMALL);
        assert_eq!(film.shoot(&pose, &back).total, single(2, &back));
        // Nor does it count after a change of size.
        film.shoot(&pose, &seen);
        let smaller = eye([40, 30]);
        assert_eq!(film.shoot(&pose, &smaller).total, single(4, &smaller));
        // Nor after a skipped frame.
        film.shoot(&pose, &smaller);
        film.frame += 1;
        assert_eq!(film.shoot(&pose, &smaller).total, single(7, &smaller));
        // Nor after `forget_history`.
        film.runner.forget_history();
        assert_eq!(film.shoot(&pose, &smaller).total, single(8, &smaller));
        // Rendering the film again gives the same bits, also if its frames run several times.
        let again = |repeats| {
            let mut film = Film { repeats, ..Film::new(gpu, &scene, &with_history(base.clone(), 16)) };
            [(); 3].map(|()| film.shoot(&pose, &smaller).total)
        };
        assert_eq!(again(0), again(0));
        assert_eq!(again(0), again(2));
    });
}

#[test]
fn the_motion_of_nodes_and_of_deforming_meshes_is_known() {
    with_gpu(|gpu| {
        // A moved and rotated block: the previous position of each visible point follows from the block's previous transform.
        let (scene, block, _) = room();
        let rest = Pose::rest(&scene);
        let moved = Mat4::from_rotation_translation(glam::Quat::from_rotation_y(0.1), vec3(0.1, 0.02, -0.05));
        let mut pose = rest.clone();
        pose.world[block] = moved;
        let seen = eye(SMALL).with_far(12.0);
        let mut resident = Resident::new(gpu, &scene).unwrap();
        let mut runner = Runner::new(gpu);
        let mut last = (Vec::new(), Vec::new());
        for (frame, pose) in [&rest, &pose].into_iter().enumerate() {
            let mut graph = Graph::new("motion");
            graph.frame = frame as u32;
            let handles = resident.frame_in(&mut graph, &scene, pose);
            let g = lucerna::passes::gbuffer::draw(&mut graph, &handles, &seen, &Default::default());
            let motion = motion::draw(&mut graph, &handles, &g, &seen, "igi");
            let tokens = [motion, g.depth].map(|image| graph.read_image(image));
            let frame = runner.run(&graph).unwrap();
            last = (frame.image(tokens[0]).to_f32(), frame.image(tokens[1]).to_f32());
        }
        let mut found = 0;
        for (i, (motion, depth)) in last.0.iter().zip(&last.1).enumerate() {
            let uv = glam::vec2((i % 48) as f32 + 0.5, (i / 48) as f32 + 0.5) / glam::vec2(48.0, 36.0);
            let place = seen.world_from_depth(uv, depth[0]);
            let before = moved.inverse().transform_point3(place);
            // Whether the point is on the block, in the block's object space, and not on the walls, which do not move.
            let own = before.clamp(vec3(-0.3, -0.6, -0.3), vec3(0.3, 0.0, 0.3)).distance(before) < 1e-4;
            assert_eq!(motion[3] > 0.0, own, "pixel {i}: {motion:?}");
            if own {
                found += 1;
                let told = Vec3::from_slice(&motion[..3]);
                // GPUs interpolate up to 1/256 pixel beside the middle of the pixel.
                assert!(told.distance(before) < 1e-3, "pixel {i}: {told} instead of {before}");
            }
        }
        assert!(found > 100, "{found} pixels of the block");

        // Skins and morph targets: at the previous position of a pixel's surface, the previous picture shows a surface.
        let scene = builtin::load("figure").unwrap();
        let poses = [0.4f32, 0.44].map(|t| Pose::playing(&scene, t));
        let mut resident = Resident::new(gpu, &scene).unwrap();
        let mut shots: Vec<(View, Texels, Texels)> = Vec::new();
        for (frame, pose) in poses.iter().enumerate() {
            let mut graph = Graph::new("motion");
            graph.frame = frame as u32;
            let handles = resident.frame_in(&mut graph, &scene, pose);
            let seen = View::of_camera(&scene, pose, 0, [128, 96]).unwrap().with_far(30.0);
            let g = lucerna::passes::gbuffer::draw(&mut graph, &handles, &seen, &Default::default());
            let motion = motion::draw(&mut graph, &handles, &g, &seen, "igi");
            let tokens = [motion, g.depth].map(|image| graph.read_image(image));
            let frame = runner.run(&graph).unwrap();
            shots.push((seen, frame.image(tokens[0]).to_f32(), frame.image(tokens[1]).to_f32()));
        }
        let (before, _, depths) = &shots[0];
        let (now, motion, own) = &shots[1];
        // Distance between a point and the surface in the previous picture, along the line of sight, metres.
        let off = |place: Vec3| {
            let clip = before.clip_from_world * place.extend(1.0);
            let (u, v) = (0.5 + 0.5 * clip.x / clip.w, 0.5 - 0.5 * clip.y / clip.w);
            let at = ((v * 96.0) as usize).min(95) * 128 + ((u * 128.0) as usize).min(127);
            f64::from((depths[at][0] * before.far + before.view_from_world.transform_point3(place).z).abs())
        };
        let (mut with, mut without, mut longest) = (Vec::new(), Vec::new(), 0.0f32);
        for (i, moved) in motion.iter().enumerate().filter(|(_, m)| m[3] > 0.0) {
            let uv = glam::vec2((i % 128) as f32 + 0.5, (i / 128) as f32 + 0.5) / glam::vec2(128.0, 96.0);
            let place = now.world_from_depth(uv, own[i][0]);
            let was = Vec3::from_slice(&moved[..3]);
            longest = longest.max(was.distance(place));
            with.push(off(was));
            without.push(off(place));
        }
        let middle = |mut all: Vec<f64>| {
            all.sort_by(f64::total_cmp);
            all[all.len() / 2]
        };
        let count = with.len();
        let (with, without) = (middle(with), middle(without));
        println!("figure: {count} pixels, longest way {longest} m, off by {with} with its motion, {without} without");
        assert!(count > 300 && longest > 0.01 && longest < 1.0, "{count} pixels, {longest} m");
        assert!(with < 0.5 * without, "{with} {without}");
    });
}

/// The errors of a film against the true pictures, and the change of the error from frame to frame.
struct Course {
    errors: Vec<f64>,
    /// Root mean square over pixels and frames, relative to the mean.
    flicker: f64,
}

fn course(shots: &[Shot], right: &[Shot], of: impl Fn(usize) -> bool + Copy) -> Course {
    let errors = shots.iter().zip(right).map(|(s, r)| error(&s.irradiance, &r.irradiance, of)).collect();
    let (mut sum, mut all, mut count) = (0.0, 0.0, 0.0);
    for frame in 1..shots.len() {
        for i in (0..shots[frame].irradiance.len()).filter(|&i| of(i)) {
            let off = |frame: usize| brightness(&shots[frame].irradiance[i]) - brightness(&right[frame].irradiance[i]);
            sum += (off(frame) - off(frame - 1)).powi(2);
            all += brightness(&right[frame].irradiance[i]);
            count += 1.0;
        }
    }
    Course { errors, flicker: (sum / count).sqrt() / (all / count) }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Renders one sequence of poses with several settings.
fn films(gpu: &Gpu, scene: &Scene, poses: &[Pose], view: &View, settings: &[Settings]) -> Vec<Vec<Shot>> {
    let film = |s: &Settings| {
        let mut film = Film::new(gpu, scene, s);
        poses.iter().map(|pose| film.shoot(pose, view)).collect()
    };
    settings.iter().map(film).collect()
}

/// Maximum change of a resting scene from frame to frame with a history of 32 frames, root mean square over pixels relative to the mean. The
/// value is stated in samples/igi/README.md.
const REST: f64 = 0.012;

#[test]
fn a_resting_scene_does_not_flicker() {
    with_gpu(|gpu| {
        let (scene, ..) = room();
        let seen = eye(TINY);
        let poses = vec![Pose::rest(&scene); 44];
        let base = Settings { specular: false, direct_samples: 1, bounces: 2, vpls: 60, ..Settings::default() };
        let all = films(gpu, &scene, &poses, &seen, &[with_history(base.clone(), 32), with_history(base, 1)]);
        // Change from frame to frame, and standard deviation over twelve frames.
        let unrest = |shots: &[Shot]| {
            let pairs: Vec<f64> =
                shots.windows(2).map(|p| error(&p[1].irradiance, &p[0].irradiance, |_| true).powi(2)).collect();
            let (mut variance, mut light) = (0.0, 0.0);
            for i in 0..shots[0].irradiance.len() {
                let values: Vec<f64> = shots.iter().map(|s| brightness(&s.irradiance[i])).collect();
                let middle = mean(&values);
                variance += values.iter().map(|v| (v - middle).powi(2)).sum::<f64>() / (values.len() - 1) as f64;
                light += middle;
            }
            let count = shots[0].irradiance.len() as f64;
            (mean(&pairs).sqrt(), (variance / count).sqrt() / (light / count))
        };
        let [long, none] = [0, 1].map(|i: usize| unrest(&all[i][32..]));
        println!("at rest, from frame to frame and over twelve: {long:.5?} with 32 frames, {none:.5?} with none");
        assert!(long.0 < REST && none.0 > 5.0 * long.0, "{long:?} {none:?}");
        assert!(long.1 < 0.02 && none.1 > 3.0 * long.1, "{long:?} {none:?}");
    });
}

/// Maximum change beyond the true change, in the same measure, while a lamp crosses the room within half a second.
const MOVING: f64 = 0.16;

#[test]
fn moving_lights_leave_no_ghosts() {
    with_gpu(|gpu| {
        let (scene, _, lamp) = room();
        let seen = eye(TINY);
        // The lamp rests, moves to the other side in 16 frames, and rests.
        let poses: Vec<Pose> = (0..28)
            .map(|frame| {
                let t = ((frame as f32 - 6.0) / 16.0).clamp(0.0, 1.0);
                let mut pose = Pose::rest(&scene);
                pose.world[lamp] = Mat4::from_translation(vec3(0.7, 0.7, 0.2).lerp(vec3(-0.7, 0.6, -0.1), t));
                pose
            })
            .collect();
        let base = Settings { specular: false, direct_samples: 1, bounces: 2, vpls: 60, ..Settings::default() };
        let right = Settings { vpls: 600, candidates: 1, ..base.clone() };
        let deaf = Settings { history_lag: 10.0, ..with_history(base.clone(), 32) };
        let all = films(
            gpu,
            &scene,
            &poses,
            &seen,
            &[right, base.clone(), with_history(base.clone(), 1), with_history(base, 32), deaf],
        );
        let [same, fresh, long, deaf] = [1, 2, 3, 4].map(|i: usize| course(&all[i], &all[0], |_| true));
        for (name, c) in [("same numbers", &same), ("own numbers", &fresh), ("history", &long), ("all frames", &deaf)] {
            let parts = [0..6, 6..22, 22..28].map(|part| mean(&c.errors[part]));
            println!("{name}: error at rest, moving, after {parts:.4?}, flicker {:.4}", c.flicker);
        }
        let moving = 8..22;
        let [fresh_error, long_error, deaf_error] = [&fresh, &long, &deaf].map(|c| mean(&c.errors[moving.clone()]));
        // The lag of the history is smaller than the error of a single frame, and much smaller than without the detection of changes.
        assert!(long_error < 0.75 * fresh_error, "{long_error} {fresh_error}");
        let after = [&long, &deaf].map(|c| mean(&c.errors[20..]));
        assert!(long_error < deaf_error && after[0] < 0.65 * after[1], "{long_error} {deaf_error} {after:?}");
        assert!(long.flicker < MOVING && long.flicker < 0.5 * fresh.flicker, "{} {}", long.flicker, fresh.flicker);
    });
}

#[test]
fn light_that_goes_out_is_gone() {
    with_gpu(|gpu| {
        // Two lamps; the stronger one is switched off. Its light must disappear within a few frames.
        let (mut scene, _, lamp) = room();
        let far = scene.nodes[lamp].clone();
        scene.nodes.push(far);
        let seen = eye(TINY);
        let away = Mat4::from_translation(vec3(50.0, 0.0, 0.0));
        let poses: Vec<Pose> = (0..12)
            .map(|frame| {
                let mut pose = Pose::rest(&scene);
                pose.world[lamp] = Mat4::from_translation(vec3(0.7, 0.7, 0.2));
                pose.world[lamp + 1] = if frame < 8 { Mat4::from_translation(vec3(-0.7, 0.6, 0.3)) } else { away };
                pose
            })
            .collect();
        let base = Settings { specular: false, direct_samples: 1, bounces: 2, vpls: 60, ..Settings::default() };
        let right = Settings { vpls: 600, candidates: 1, ..base.clone() };
        let all = films(gpu, &scene, &poses, &seen, &[right, with_history(base.clone(), 1), with_history(base, 32)]);
        let sum = |shot: &Shot| shot.irradiance.iter().map(brightness).sum::<f64>();
        // The bounds are stated in samples/igi/README.md.
        for (frame, most) in [(8, 0.12), (9, 0.06), (11, 0.05)] {
            let (found, right) = (sum(&all[2][frame]), sum(&all[0][frame]));
            let alone = sum(&all[1][frame]);
            println!("frame {frame}: {} of the light, alone {}", found / right, alone / right);
            assert!((found / right - 1.0).abs() < most, "frame {frame}: {} of the light", found / right);
        }
    });
}

#[test]
fn what_comes_into_view_has_no_past_and_the_rest_keeps_it() {
    with_gpu(|gpu| {
        let (scene, ..) = room();
        let pose = Pose::rest(&scene);
        let base = Settings { specular: false, direct_samples: 1, bounces: 2, vpls: 40, ..Settings::default() };
        let mut film = Film::new(gpu, &scene, &with_history(base.clone(), 32));
        let at = |frame: u32| {
            let x = 0.01 * frame as f32 + if frame == 15 { 0.25 } else { 0.0 };
            view(vec3(x - 0.2, 0.1, 0.95), vec3(x - 0.3, -0.35, -0.6), 75.0, SMALL)
        };
        let frames = 16;
        let shots: Vec<Shot> = (0..frames).map(|frame| film.shoot(&pose, &at(frame))).collect();
        let last = &shots[frames as usize - 1];
        let mut alone = Film::new(gpu, &scene, &with_history(base.clone(), 1));
        alone.frame = frames - 1;
        let alone = alone.shoot(&pose, &at(frames - 1));
        let right = Settings { vpls: 2000, candidates: 1, ..base };
        let right = Film::new(gpu, &scene, &right).shoot(&pose, &at(frames - 1));
        let new: Vec<usize> = (0..last.irradiance.len()).filter(|&i| last.irradiance[i][3] == 1.0).collect();
        let old = |i: usize| last.irradiance[i][3] > 12.0;
        let count = (0..last.irradiance.len()).filter(|&i| old(i)).count();
        assert!(new.len() > 20 && count > last.irradiance.len() / 2, "{} new, {count} old pixels", new.len());
        for &i in &new {
            assert_eq!(last.irradiance[i][..3], alone.irradiance[i][..3], "pixel {i}");
        }
        let [kept, frame] = [last, &alone].map(|shot| error(&shot.irradiance, &right.irradiance, old));
        println!("camera in motion: error {kept} with the past, {frame} without");
        assert!(kept < 0.6 * frame, "{kept} {frame}");
    });
}

#[test]
fn a_figure_that_walks_is_no_worse_than_without_a_past() {
    with_gpu(|gpu| {
        let scene = builtin::load("figure").unwrap();
        let poses: Vec<Pose> = (0..8).map(|frame| Pose::playing(&scene, 0.3 + frame as f32 / 30.0)).collect();
        let seen = View::of_camera(&scene, &poses[0], 0, SMALL).unwrap();
        let base =
            Settings { specular: false, direct_samples: 1, bounces: 2, vpls: 40, candidates: 4, ..Settings::default() };
        let right = Settings { vpls: 300, candidates: 1, ..base.clone() };
        let all = films(gpu, &scene, &poses, &seen, &[right, with_history(base.clone(), 1), with_history(base, 16)]);
        let surface = |i: usize| all[0].iter().all(|shot| shot.depth[i] < 1.0);
        let [fresh, long] = [1, 2].map(|i: usize| course(&all[i], &all[0], surface));
        let [fresh_error, long_error] = [&fresh, &long].map(|c| mean(&c.errors[4..]));
        println!(
            "figure: error {long_error} with a past, {fresh_error} without; flicker {} {}",
            long.flicker, fresh.flicker
        );
        assert!(long_error < fresh_error && long.flicker < 0.8 * fresh.flicker, "{long_error} {fresh_error}");
    });
}
