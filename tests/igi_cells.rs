//! The irradiance cache on two surfaces beside a wall, in a mirror: the light on this side of it is not shown on the other.

use crate::igi_lab::{Studio, room};
use crate::tracer_lab::flat_view;
use glam::{Vec3, vec3};
use lucerna::{gpu::testing::with_gpu, scene::Material, techniques::igi::Settings};

/// Side of a cell, metres. Cells begin at odd multiples of its half.
const CELL: f32 = 0.1;

/// Two surfaces that meet at a black wall.
struct Pair {
    name: &'static str,
    /// Where the wall stands.
    wall: f32,
    /// Height of the left and of the right surface at the wall.
    height: [f32; 2],
    /// How far the surfaces go down for each metre away from the wall.
    slope: f32,
    /// Width of each surface, metres.
    width: f32,
}

/// Mean indirect light left and right of the wall, in a mirror of 45° above both surfaces.
fn sides(studio: &mut Studio, pair: &Pair, settings: &Settings) -> [Vec3; 2] {
    const SIDE: usize = 32;
    let size = (2.0 * pair.width).min(0.4);
    let eye = vec3(pair.wall, 0.0, 0.95);
    let seen = flat_view(eye, eye - Vec3::Z, size, [SIDE as u32; 2]);
    let all = studio.render(&seen, settings, 0).total;
    let direct = studio.render(&seen, &Settings { indirect: false, ..settings.clone() }, 0).total;
    let mut sums = [Vec3::ZERO; 2];
    for (i, (all, direct)) in all.iter().zip(&direct).enumerate() {
        let light = Vec3::from_slice(&all[..3]) - Vec3::from_slice(&direct[..3]);
        sums[usize::from(i % SIDE >= SIDE / 2)] += light / (SIDE * SIDE / 2) as f32;
    }
    sums
}

#[test]
fn light_of_a_cell_stays_on_surfaces_of_its_plane_and_direction() {
    with_gpu(|gpu| {
        let level = Pair { name: "levels", wall: 0.0, height: [-0.875, -0.825], slope: 0.0, width: 1.0 };
        // Both slopes belong to the same class of directions, and one cell ends at the wall.
        let roof = Pair { name: "gentle roof", wall: 0.5 * CELL, height: [-0.5; 2], slope: 0.364, width: 0.9 };
        // The slopes belong to different classes. Both lie in the cells that the wall divides.
        let ridge = Pair { name: "steep ridge", wall: 0.0, height: [-0.5; 2], slope: 0.7, width: 0.045 };
        for pair in [level, roof, ridge] {
            let mut stage = room(Vec3::splat(0.7));
            let white = stage.material(Material { ior: 1.0, ..Material::diffuse("white", Vec3::splat(0.7)) });
            let black = stage.material(Material { ior: 1.0, ..Material::diffuse("black", Vec3::ZERO) });
            let tint = vec3(0.9, 0.5, 0.2);
            let mirror = Material { metallic: 1.0, roughness: 0.0, ..Material::diffuse("mirror", tint) };
            let mirror = stage.material(mirror);
            let depth = 2.0 * Vec3::Z;
            let away = vec3(1.0, -pair.slope, 0.0) * pair.width;
            let [left, right] = pair.height.map(|y| vec3(pair.wall, y, -1.0));
            stage.quad(white, left, depth, vec3(-away.x, away.y, 0.0));
            stage.quad(white, right, depth, away);
            stage.quad(black, vec3(pair.wall, -1.1, -1.1), 2.2 * Vec3::Z, 2.2 * Vec3::Y);
            stage.quad(mirror, vec3(-1.0, -0.4, -0.6), 2.0 * Vec3::X, vec3(0.0, 0.8, 0.8));
            stage.point(vec3(-0.6, -0.1, 0.6), Vec3::ONE);
            let mut studio = Studio::new(gpu, &stage.scene);
            let settings = Settings { bounces: 1, vpls: 300, candidates: 1, bound: 0.05, ..Settings::default() };
            let exact = sides(&mut studio, &pair, &settings);
            assert!(exact[0].min_element() > 1e-3 && exact[1] == Vec3::ZERO, "{}: {exact:?}", pair.name);
            let diagonal = vec3(2.0, 2.2, 2.2).length();
            let found = sides(&mut studio, &pair, &Settings { cache: CELL / diagonal, ..settings });
            let [left, right] = [found[0] / exact[0], found[1] / exact[0]];
            println!("{}: {left} of the light on its side, {right} beyond the wall", pair.name);
            assert!(right.max_element() < 2e-3, "{}: {right} beyond the wall", pair.name);
            assert!((left - 1.0).abs().max_element() < 0.1, "{}: {left} of the light on its side", pair.name);
        }
    });
}
