//! The graphs that the executables run: plans checked, each barrier dropped in turn, and the whole clean under
//! synchronisation validation, the same bits twice.

use lucerna::{
    gpu::testing::with_gpu,
    graph::{Graph, Runner, testing::every_barrier_matters},
    passes::{ambient::Irradiance, shadow},
    resident::Resident,
    scene::{Pose, View},
    techniques::{
        fiv::{self, Fiv, Method},
        isr::{Blur, PictureSettings, Resolution, picture},
    },
};
use lucerna_scenes as builtin;

fn settings() -> Vec<PictureSettings> {
    let default = PictureSettings::default();
    let mut plain = default.clone();
    plain.shadow.kind = shadow::Kind::Plain;
    plain.isr.blur = Blur::None;
    plain.isr.resolution = Resolution::Full;
    let mut off = default.clone();
    off.shadow.kind = shadow::Kind::Off;
    off.isr.bounces = 3;
    let mut exponential = PictureSettings::paper();
    exponential.shadow.size = 64;
    let mut beyond = default.clone();
    (beyond.isr.border, beyond.isr.layers, beyond.isr.cameras) = (0.5, 2, 1);
    beyond.isr.samples_by_depth = true;
    vec![default, plain, off, exponential, beyond]
}

#[test]
fn every_barrier_of_the_shipped_graphs_matters() {
    with_gpu(|gpu| {
        let mut runner = Runner::new(gpu);
        // Lights of several kinds; an area light; a deforming figure.
        for name in ["cornell-area", "office", "figure"] {
            let scene = builtin::load(name).unwrap();
            let ambient = scene.environment.as_ref().map(Irradiance::of).unwrap_or_default();
            let mut resident = Resident::new(gpu, &scene).unwrap();
            for (number, settings) in settings().iter().enumerate() {
                let mut pictures = Vec::new();
                for _ in 0..2 {
                    let mut graph = Graph::new("shipped");
                    let pose = Pose::playing(&scene, 0.25);
                    let handles = resident.frame_in(&mut graph, &scene, &pose);
                    let view = View::of_camera(&scene, &pose, 0, [64, 48]).unwrap().fit_far(&handles.bounds());
                    let out = picture(&mut graph, &handles, &view, ambient.clone(), settings).unwrap();
                    let dump = graph.dump();
                    let total = graph.read_image(out.outputs.total);
                    if pictures.is_empty() {
                        let plan = every_barrier_matters(&graph);
                        assert!(plan.barriers.len() > 30 && dump.len() > 5, "{name}: {}", plan.list_passes());
                    }
                    let frame = runner.run(&graph).unwrap_or_else(|e| panic!("{name}, settings {number}: {e}"));
                    let pixels = frame.image(total);
                    assert!(pixels.to_f32().iter().flatten().all(|v| v.is_finite()), "{name}, settings {number}");
                    pictures.push(pixels.bytes);
                }
                assert_eq!(pictures[0], pictures[1], "{name}, settings {number}: two runs differ");
            }
        }
    });
}

#[test]
fn every_barrier_of_irradiance_vectors_matters() {
    with_gpu(|gpu| {
        let mut runner = Runner::new(gpu);
        // Occluders that stand still, move, turn and deform.
        let scene = builtin::load("shadows-moving").unwrap();
        for method in [Method::Online, Method::Vectors, Method::BruteForce, Method::Unshadowed] {
            let (azimuths, polars, radii, size) = (6, 5, 4, 8);
            let fiv = fiv::Settings { azimuths, polars, radii, size, method, ..fiv::Settings::default() };
            let settings = fiv::PictureSettings { fiv, ..fiv::PictureSettings::default() };
            let mut pictures = Vec::new();
            for _ in 0..2 {
                let mut resident = Resident::new(gpu, &scene).unwrap();
                let mut fiv = Fiv::new(gpu, &scene, &resident, &settings.fiv, None, |_, _| true).unwrap();
                // The second frame moves on from the first.
                for seconds in [0.25, 0.5] {
                    let mut graph = Graph::new("shipped");
                    let pose = Pose::playing(&scene, seconds);
                    let handles = resident.frame_in(&mut graph, &scene, &pose);
                    let view = View::of_camera(&scene, &pose, 0, [32, 24]).unwrap().fit_far(&handles.bounds());
                    let out = fiv.picture(&mut graph, &scene, &pose, &handles, &view, &settings).unwrap();
                    let total = graph.read_image(out.outputs.total);
                    if pictures.is_empty() {
                        let plan = every_barrier_matters(&graph);
                        assert!(plan.barriers.len() > 10, "{method:?}: {}", plan.list_passes());
                    }
                    let frame = runner.run(&graph).unwrap_or_else(|e| panic!("{method:?}: {e}"));
                    let pixels = frame.image(total);
                    assert!(pixels.to_f32().iter().flatten().all(|v| v.is_finite()), "{method:?}");
                    pictures.push(pixels.bytes);
                }
            }
            assert!(pictures[0] == pictures[2] && pictures[1] == pictures[3], "{method:?}: two runs differ");
            assert!(pictures[0] != pictures[1], "{method:?}: nothing moves");
        }
    });
}
