//! A sequence of sixty frames in which a lamp moves. The test measures the flicker of the indirect light, which is its change from frame to
//! frame beyond the true change, and its error; samples/igi/README.md states both.

use glam::{Mat4, Vec3, vec3};
use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    graph::{Graph, Runner},
    resident::Resident,
    scene::{Light, LightKind, Node, Pose, Scene, View},
    techniques::igi::{Igi, PictureSettings, Settings},
};
use lucerna_scenes as builtin;

const SIZE: [u32; 2] = [48, 32];
const FRAMES: usize = 60;
/// The lamp moves from the first of these to the last one.
const MOVES: std::ops::Range<usize> = 20..40;

/// Maximum change per frame while the scene rests: mean over pixels relative to the mean light.
const REST: f64 = 0.014;
/// Maximum difference between the change of a frame and the true change while the lamp moves, in any frame.
const MOVING: f64 = 0.145;
/// Maximum error of a frame, from the eighth on.
const ERROR: f64 = 0.195;

/// Irradiance, red, green and blue together.
type Film = Vec<Vec<f64>>;

/// The Cornell box with a second lamp, and the number of the lamp's node.
fn scene() -> (Scene, usize) {
    let mut scene = builtin::load("cornell").unwrap();
    let kind = LightKind::Point { range: None };
    scene.lights.push(Light { name: "moves".into(), kind, color: Vec3::ONE, intensity: 0.1 });
    let light = Some(scene.lights.len() as u32 - 1);
    scene.nodes.push(Node { light, ..Node::default() });
    let node = scene.nodes.len() - 1;
    (scene, node)
}

/// The lamp rests, moves to the other side within two thirds of a second, and rests.
fn poses(scene: &Scene, lamp: usize) -> Vec<Pose> {
    let (from, to) = (vec3(0.12, 0.4, 0.2), vec3(0.44, 0.4, 0.2));
    let pose = |frame: usize| {
        let t = (frame as f32 - MOVES.start as f32) / MOVES.len() as f32;
        let mut pose = Pose::rest(scene);
        pose.world[lamp] = Mat4::from_translation(from.lerp(to, t.clamp(0.0, 1.0)));
        pose
    };
    (0..FRAMES).map(pose).collect()
}

/// The wanted frames of the sequence; all frames are rendered in order.
fn film(gpu: &Gpu, scene: &Scene, poses: &[Pose], settings: &Settings, wanted: impl Fn(usize) -> bool) -> Film {
    let mut resident = Resident::new(gpu, scene).unwrap();
    let mut igi = Igi::new(gpu, scene, &resident, settings).unwrap();
    let mut runner = Runner::new(gpu);
    let all = PictureSettings { igi: settings.clone(), ..Default::default() };
    let mut shoot = |frame: usize| {
        let mut graph = Graph::new("sixty");
        graph.frame = frame as u32;
        let handles = resident.frame_in(&mut graph, scene, &poses[frame]);
        let view = View::of_camera(scene, &poses[frame], 0, SIZE).unwrap().fit_far(&handles.bounds());
        let picture = igi.picture(&mut graph, scene, &poses[frame], &handles, &view, &all).unwrap();
        let irradiance = graph.read_image(picture.outputs.irradiance);
        let pixels = runner.run(&graph).unwrap().image(irradiance).to_f32();
        pixels.iter().map(|p| f64::from(p[0]) + f64::from(p[1]) + f64::from(p[2])).collect()
    };
    (0..poses.len()).map(|frame| if wanted(frame) { shoot(frame) } else { Vec::new() }).collect()
}

/// Mean absolute difference over the mean light, and the root mean square, which the few brightest pixels dominate.
fn relative(difference: impl Iterator<Item = f64>, light: &[f64]) -> [f64; 2] {
    let (mut sum, mut squares) = (0.0, 0.0);
    for d in difference {
        sum += d.abs();
        squares += d * d;
    }
    let count = light.len() as f64;
    let mean = light.iter().sum::<f64>() / count;
    [sum / count / mean, (squares / count).sqrt() / mean]
}

/// Over frames: the largest mean, and the largest root mean square.
fn most(values: impl IntoIterator<Item = [f64; 2]>) -> [f64; 2] {
    values.into_iter().fold([0.0; 2], |most, of| [most[0].max(of[0]), most[1].max(of[1])])
}

/// Visible defects of a film, compared with the true film.
#[derive(Debug)]
struct Seen {
    /// Change from frame to frame, before the lamp moves and long after it.
    rest: [f64; 2],
    /// Difference from the true change, in the worst frame.
    moving: [f64; 2],
    /// Error in the worst frame from the eighth on.
    error: [f64; 2],
}

fn seen(film: &Film, right: &Film) -> Seen {
    let change = |frame: usize| {
        relative(film[frame].iter().zip(&film[frame - 1]).map(|(now, before)| now - before), &right[frame])
    };
    let off = |frame: usize| {
        let pixels = (0..film[frame].len())
            .map(|i| (film[frame][i] - film[frame - 1][i]) - (right[frame][i] - right[frame - 1][i]));
        relative(pixels, &right[frame])
    };
    let error = |frame: usize| relative(film[frame].iter().zip(&right[frame]).map(|(f, r)| f - r), &right[frame]);
    Seen {
        rest: most((16..=MOVES.start).chain(52..FRAMES).map(change)),
        moving: most((MOVES.start..=MOVES.end).map(off)),
        error: most((8..FRAMES).map(error)),
    }
}

#[test]
fn sixty_frames_with_a_moving_lamp_keep_the_stated_bounds() {
    with_gpu(|gpu| {
        let (scene, lamp) = scene();
        let poses = poses(&scene, lamp);
        let base = Settings { specular: false, direct_samples: 1, bounces: 2, vpls: 60, ..Settings::default() };
        let truth = Settings { vpls: 600, candidates: 1, ..base.clone() };
        let moves = |frame: usize| MOVES.contains(&frame) || frame == 0;
        let mut right = film(gpu, &scene, &poses, &truth, moves);
        // While the scene rests, the true picture does not change.
        let after = film(gpu, &scene, &poses, &truth, |frame| frame == MOVES.end).swap_remove(MOVES.end);
        for frame in 0..FRAMES {
            if frame < MOVES.start {
                right[frame] = right[0].clone();
            } else if frame >= MOVES.end {
                right[frame].clone_from(&after);
            }
        }
        let [long, none] = [32, 1]
            .map(|history| seen(&film(gpu, &scene, &poses, &Settings { history, ..base.clone() }, |_| true), &right));
        println!("history of 32: {long:.4?}");
        println!("history of 1:  {none:.4?}");
        assert!(long.rest[0] < REST && long.moving[0] < MOVING && long.error[0] < ERROR, "{long:?}");
        // Without a history all bounds are exceeded.
        assert!(none.rest[0] > 3.0 * REST && none.moving[0] > 1.5 * MOVING && none.error[0] > ERROR, "{none:?}");
    });
}
