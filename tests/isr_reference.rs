//! Pictures of the Cornell box against one bounce of path tracing on the CPU.

use glam::Vec3;
use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    graph::{Graph, Runner},
    passes::{ambient::Irradiance, shadow},
    reference::path,
    resident::Resident,
    scene::{Pose, Scene, View, bvh::Bvh},
    techniques::isr::{Estimator, Pattern, PictureSettings, Resolution, Settings, picture},
};
use lucerna_scenes as builtin;

const EXTENT: [u32; 2] = [160, 120];

fn first_view(scene: &Scene, pose: &Pose) -> View {
    let node = scene.nodes.iter().position(|node| node.camera.is_some()).unwrap();
    View::new(&scene.cameras[scene.nodes[node].camera.unwrap() as usize], pose.world[node], EXTENT)
}

/// Direct and indirect light of the whole picture.
fn render(gpu: &Gpu, scene: &Scene, settings: &Settings) -> [Vec<[f32; 4]>; 2] {
    let mut resident = Resident::new(gpu, scene).unwrap();
    let mut graph = Graph::new("isr");
    let pose = Pose::rest(scene);
    let handles = resident.frame_in(&mut graph, scene, &pose);
    let view = first_view(scene, &pose).fit_far(&handles.bounds());
    let settings = PictureSettings {
        isr: Settings { specular: false, ..settings.clone() },
        shadow: shadow::Settings { kind: shadow::Kind::Pcf, ..Default::default() },
        ..Default::default()
    };
    let shown = picture(&mut graph, &handles, &view, Irradiance::default(), &settings).unwrap();
    let tokens = [shown.outputs.direct, shown.outputs.indirect].map(|image| graph.read_image(image));
    let frame = Runner::new(gpu).run(&graph).unwrap();
    tokens.map(|token| frame.image(token).to_f32())
}

/// A pixel and its light by rays.
struct Truth {
    pixel: usize,
    direct: Vec3,
    /// One bounce from everywhere.
    indirect: Vec3,
    /// One bounce from surfaces that the camera sees: as much as a method can know that has only the picture.
    from_visible: Vec3,
}

/// On a coarse raster.
fn reference(scene: &Scene) -> Vec<Truth> {
    let pose = Pose::rest(scene);
    let view = first_view(scene, &pose);
    let bvh = Bvh::build(scene, &pose);
    let trace = |seen_senders_only| {
        let settings = path::Settings {
            samples: 500,
            bounces: 1,
            diffuse_only: true,
            every: 6,
            seen_senders_only,
            ..Default::default()
        };
        path::trace(scene, &pose, &bvh, &view, &settings)
    };
    let (all, seen) = (trace(false), trace(true));
    (0..all.albedo.len())
        .filter(|&pixel| all.albedo[pixel] != Vec3::ZERO)
        .map(|pixel| Truth {
            pixel,
            direct: all.direct[pixel],
            indirect: all.indirect[pixel],
            from_visible: seen.indirect[pixel],
        })
        .collect()
}

/// Mean over the reference's mean, mean absolute error over the reference's mean, and correlation, of luminance.
fn compare(found: &[[f32; 4]], expected: impl Iterator<Item = (usize, Vec3)> + Clone) -> (f64, f64, f64) {
    let luminance = |c: Vec3| f64::from(c.dot(Vec3::new(0.2126, 0.7152, 0.0722)));
    let pairs: Vec<(f64, f64)> =
        expected.map(|(i, e)| (luminance(Vec3::new(found[i][0], found[i][1], found[i][2])), luminance(e))).collect();
    let count = pairs.len() as f64;
    let (mean_f, mean_e) =
        (pairs.iter().map(|p| p.0).sum::<f64>() / count, pairs.iter().map(|p| p.1).sum::<f64>() / count);
    let error = pairs.iter().map(|p| (p.0 - p.1).abs()).sum::<f64>() / count;
    let (mut cov, mut var_f, mut var_e) = (0.0, 0.0, 0.0);
    for (f, e) in &pairs {
        cov += (f - mean_f) * (e - mean_e);
        var_f += (f - mean_f).powi(2);
        var_e += (e - mean_e).powi(2);
    }
    (mean_f / mean_e, error / mean_e, cov / (var_f * var_e).sqrt())
}

#[test]
fn the_cornell_box_by_rays() {
    let scene = builtin::load("cornell").unwrap();
    let expected = reference(&scene);
    assert!(expected.len() > 200);
    let all: Vec3 = expected.iter().map(|e| e.indirect).sum();
    let seen: Vec3 = expected.iter().map(|e| e.from_visible).sum();
    println!("{:?} of the indirect light comes from what the camera sees", seen / all);
    with_gpu(|gpu| {
        let default = Settings::default();
        let choices = [
            ("default", default.clone()),
            ("24 samples", Settings { samples: 24, ..default.clone() }),
            ("80 samples", Settings { samples: 80, ..default.clone() }),
            ("full resolution", Settings { resolution: Resolution::Full, samples: 80, ..default.clone() }),
            ("no prefilter", Settings { prefilter: false, ..default.clone() }),
            ("all visible", Settings { visibility_steps: 0, ..default.clone() }),
            ("reach 40", Settings { reach: 40.0, ..default.clone() }),
            ("grid", Settings { pattern: Pattern::Grid, ..default.clone() }),
            ("paper's sum", Settings { estimator: Estimator::Paper, ..default.clone() }),
        ];
        for (name, settings) in choices {
            let [direct, indirect] = render(gpu, &scene, &settings);
            let (share, error, correlation) = compare(&indirect, expected.iter().map(|e| (e.pixel, e.from_visible)));
            println!("{name:>16}: indirect {share:.3} of the visible, error {error:.3}, correlation {correlation:.3}");
            if matches!(name, "default" | "80 samples" | "full resolution") {
                assert!((share - 1.0).abs() < 0.2 && error < 0.3 && correlation > 0.88, "{name}");
                let (share, error, correlation) = compare(&direct, expected.iter().map(|e| (e.pixel, e.direct)));
                println!(
                    "          direct: {share:.3} of the reference, error {error:.3}, correlation {correlation:.3}"
                );
                assert!((share - 1.0).abs() < 0.02 && error < 0.02 && correlation > 0.99);
            }
        }
    });
}
