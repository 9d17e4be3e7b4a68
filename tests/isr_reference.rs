//! Pictures of the Cornell box against one bounce of ray casting on the CPU.

use glam::{Vec2, Vec3};
use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    graph::{Graph, Runner},
    passes::{ambient::Irradiance, shadow},
    reference::one_bounce::OneBounce,
    scene::{Pose, Scene, View, builtin, resident::Resident},
    techniques::isr::{Estimator, Pattern, PictureSettings, Settings, picture},
};

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

/// Pixel, direct light and one bounce, by rays, on a coarse raster.
fn reference(scene: &Scene) -> Vec<(usize, Vec3, Vec3)> {
    let pose = Pose::rest(scene);
    let view = first_view(scene, &pose);
    let truth = OneBounce::new(scene, &pose);
    let mut found = Vec::new();
    for y in (3..EXTENT[1]).step_by(6) {
        for x in (3..EXTENT[0]).step_by(6) {
            let uv = (Vec2::new(x as f32, y as f32) + 0.5) / Vec2::new(EXTENT[0] as f32, EXTENT[1] as f32);
            let direction = (view.world_from_depth(uv, 1.0) - view.position).normalize();
            if let Some(surface) = truth.surface(view.position, direction).filter(|s| s.albedo != Vec3::ZERO) {
                let gathered = surface.albedo * truth.gathered(&surface, 16);
                found.push(((y * EXTENT[0] + x) as usize, truth.direct(&surface), gathered));
            }
        }
    }
    found
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
    with_gpu(|gpu| {
        let choices = [
            ("default", Settings::default()),
            ("80 samples", Settings { samples: 80, ..Settings::default() }),
            ("visibility 4", Settings { visibility_steps: 4, ..Settings::default() }),
            ("visibility 8", Settings { visibility_steps: 8, ..Settings::default() }),
            ("reach 40", Settings { reach: 40.0, ..Settings::default() }),
            ("reach 160", Settings { reach: 160.0, ..Settings::default() }),
            ("grid", Settings { pattern: Pattern::Grid, ..Settings::default() }),
            ("paper's sum", Settings { estimator: Estimator::Paper, ..Settings::default() }),
        ];
        for (name, settings) in choices {
            let [direct, indirect] = render(gpu, &scene, &settings);
            let (share, error, correlation) = compare(&indirect, expected.iter().map(|e| (e.0, e.2)));
            println!(
                "{name:>14}: indirect {share:.3} of the reference, error {error:.3}, correlation {correlation:.3}"
            );
            if name == "default" {
                let (share, error, correlation) = compare(&direct, expected.iter().map(|e| (e.0, e.1)));
                println!("        direct: {share:.3} of the reference, error {error:.3}, correlation {correlation:.3}");
                assert!((share - 1.0).abs() < 0.05 && error < 0.08 && correlation > 0.98);
            }
        }
    });
}
