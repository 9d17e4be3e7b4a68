//! Pixels whose middle falls on the edge between two surfaces are lit as their neighbours are.

use crate::igi_lab::Studio;
use crate::tracer_lab::{Stage, render, view};
use glam::{Vec3, vec3};
use lucerna::{
    gpu::testing::with_gpu,
    scene::{Material, View},
    techniques::igi::Settings,
    tracer::{Filter, Settings as Traced},
};

/// A floor and a wall that meet where x = 1, and a lamp that every point of them sees.
fn corner() -> Stage {
    let mut stage = Stage::new();
    let matt = stage.material(Material { ior: 1.0, ..Material::diffuse("matt", Vec3::splat(0.6)) });
    stage.quad(matt, vec3(-1.01, 0.0, 0.99), vec3(2.01, 0.0, 0.0), vec3(0.0, 0.0, -2.03));
    stage.quad(matt, vec3(1.0, 0.0, -1.04), vec3(0.0, 0.0, 2.03), vec3(0.0, 1.99, 0.0));
    stage.point(vec3(0.0, 1.8, 0.0), Vec3::splat(3.0));
    stage
}

/// Its middle row is at the height of the lamp: the edge runs through the middle of one pixel of every row.
fn along_the_edge() -> View {
    view(vec3(0.0, 1.0, 3.4), vec3(0.0, 1.0, 0.0), 40.0, [128, 96])
}

/// How many pixels show a surface, and which of them are dark.
fn dark(pixels: impl Iterator<Item = (bool, f32)>) -> (usize, Vec<usize>) {
    let mut seen = 0;
    let mut dark = Vec::new();
    for (i, (there, light)) in pixels.enumerate() {
        seen += usize::from(there);
        if there && light < 1e-3 {
            dark.push(i);
        }
    }
    (seen, dark)
}

#[test]
fn instant_global_illumination_has_no_dark_seam() {
    with_gpu(|gpu| {
        let stage = corner();
        let settings = Settings { vpls: 8, candidates: 1, bounces: 1, direct_samples: 1, ..Settings::default() };
        let shown = Studio::new(gpu, &stage.scene).render(&along_the_edge(), &settings, 0);
        let lit = shown.direct.iter().zip(&shown.albedo).map(|(light, albedo)| (albedo[3] > 0.5, light[1]));
        let (seen, dark) = dark(lit);
        assert!(seen > 2000, "{seen}");
        assert!(dark.is_empty(), "{} dark pixels: {dark:?}", dark.len());
    });
}

#[test]
fn path_tracing_through_the_middle_of_pixels_has_no_dark_seam() {
    with_gpu(|gpu| {
        let stage = corner();
        let settings = Traced { filter: Filter::Centre, bounces: 1, ..Traced::default() };
        let layers = render(gpu, &stage.scene, &along_the_edge(), &settings, 1);
        let find = |name: &str| layers.layers.iter().find(|layer| layer.name == name).unwrap();
        let (direct, depth) = (find("direct"), find("depth"));
        let stride = direct.channels.len();
        let lit = depth
            .data
            .iter()
            .enumerate()
            .map(|(i, z)| (z.is_finite() && *z < 50.0 && *z > 0.0, direct.data[i * stride + 1]));
        let (seen, dark) = dark(lit);
        assert!(seen > 2000, "{seen}");
        assert!(dark.is_empty(), "{} dark pixels: {dark:?}", dark.len());
    });
}
