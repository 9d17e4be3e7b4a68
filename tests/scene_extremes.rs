//! Scenes near the bounds of `scene::extent` look as they do at usual sizes.

use crate::tracer_lab::{Stage, render};
use glam::{Mat4, Vec3, vec3};
use lucerna::{
    gpu::testing::with_gpu,
    graph::{Graph, Runner},
    passes::ambient::Irradiance,
    resident::Resident,
    scene::{
        Camera, Material, Projection, View,
        extent::{FARTHEST, SMALLEST},
    },
    techniques::isr,
    tracer::Settings,
};

/// A floor and a wall of `size` metres under a lamp that lights them as at any other size, and a view of them.
fn stage(size: f32) -> (Stage, View) {
    let mut stage = Stage::new();
    let matt = stage.material(Material { ior: 1.0, ..Material::diffuse("matt", vec3(0.7, 0.5, 0.3)) });
    let s = 0.5 * size;
    stage.quad(matt, vec3(-s, 0.0, s), vec3(2.0 * s, 0.0, 0.0), vec3(0.0, 0.0, -2.0 * s));
    stage.quad(matt, vec3(-s, 0.0, -s), vec3(2.0 * s, 0.0, 0.0), vec3(0.0, 2.0 * s, 0.0));
    stage.point(vec3(0.3 * s, 1.2 * s, 0.2 * s), Vec3::splat(s * s));
    let projection = Projection::Perspective { yfov: 1.0, aspect: None, znear: 0.05 * s, zfar: Some(10.0 * s) };
    // Straight along −Z, from half the wall's height.
    let world = Mat4::from_translation(vec3(0.2 * s, 0.8 * s, 1.6 * s));
    (stage, View::new(&Camera { name: String::new(), projection }, world, [24, 18]))
}

fn mean(pixels: impl Iterator<Item = [f32; 3]>) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    for pixel in pixels {
        assert!(pixel.iter().all(|v| v.is_finite() && *v >= 0.0), "{pixel:?}");
        sum += pixel.iter().map(|v| f64::from(*v)).sum::<f64>();
        count += 1;
    }
    sum / f64::from(count)
}

#[test]
fn pictures_at_both_bounds_are_as_bright_as_usual() {
    with_gpu(|gpu| {
        let mut usual = None;
        for size in [2.0, 20.0 * SMALLEST, 0.9 * FARTHEST] {
            let (stage, view) = stage(size);
            stage.scene.validate().unwrap();
            let settings = Settings { bounces: 2, ..Settings::default() };
            let layers = render(gpu, &stage.scene, &view, &settings, 8);
            let stride = layers.layers[0].channels.len();
            let traced = mean(layers.layers[0].data.chunks_exact(stride).map(|p| [p[0], p[1], p[2]]));
            let mut resident = Resident::new(gpu, &stage.scene).unwrap();
            let mut graph = Graph::new("extreme");
            let handles = resident.frame(&mut graph, &stage.scene, 0.0);
            let none = Irradiance::default();
            let picture = isr::picture(&mut graph, &handles, &view, none, &isr::PictureSettings::default()).unwrap();
            let token = graph.read_image(picture.outputs.total);
            let shown = Runner::new(gpu).run(graph).unwrap().image(token).to_f32();
            let shown = mean(shown.into_iter().map(|p| [p[0], p[1], p[2]]));
            println!("{size:e} m: path tracer {traced}, isr {shown}");
            let (traced_usually, shown_usually) = *usual.get_or_insert((traced, shown));
            assert!(traced > 0.01 && (traced / traced_usually - 1.0).abs() < 0.01, "{size:e} m: {traced}");
            assert!(shown > 0.01 && (shown / shown_usually - 1.0).abs() < 0.02, "{size:e} m: {shown}");
        }
    });
}
