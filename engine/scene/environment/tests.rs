use std::path::{Path, PathBuf};

use super::*;
use crate::{
    image::{self, Layers, WriteOptions},
    scene::{Limits, NoteKind},
};

fn asset(name: &str) -> Option<PathBuf> {
    let path = Path::new(&std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_else(|| env!("CARGO_MANIFEST_DIR").into()))
        .join("../shared/assets/environments")
        .join(name);
    if path.exists() {
        return Some(path);
    }
    assert!(std::env::var_os("CI").is_none(), "{} is missing", path.display());
    eprintln!("SKIPPED: no {}", path.display());
    None
}

fn random_directions(count: usize) -> Vec<Vec3> {
    let mut state = 5u64;
    let mut next = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1u64 << 23) as f32 - 1.0
    };
    std::iter::from_fn(|| Some(Vec3::new(next(), next(), next())))
        .filter(|v| (0.01..1.0).contains(&v.length_squared()))
        .map(Vec3::normalize)
        .take(count)
        .collect()
}

/// Smooth, bright above, different on all sides: the first nine spherical harmonics with made-up weights.
fn smooth(d: Vec3) -> Vec3 {
    Vec3::new(2.0 + d.y + 0.5 * d.x, 2.0 + 0.7 * d.z + d.x * d.y, 2.0 + 0.9 * d.y * d.y - 0.4 * d.x * d.z)
}

fn latlong(width: u32, height: u32, radiance: impl Fn(Vec3) -> Vec3) -> Environment {
    let uv = |x, y| Vec2::new((x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32);
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let pixels = pixels.map(|(x, y)| radiance(direction_from_uv(uv(x, y)))).collect();
    Environment { name: "made".into(), width, height, pixels, rotation: 0.0, scale: 1.0 }
}

fn relative(a: Vec3, b: Vec3) -> f32 {
    ((a - b).abs() / b.abs().max(Vec3::splat(1e-6))).max_element()
}

#[test]
fn the_centre_looks_down_minus_z_and_the_right_is_plus_x() {
    let near = |uv: [f32; 2], d: Vec3| assert!((direction_from_uv(uv.into()) - d).length() < 1e-6, "{uv:?}");
    near([0.5, 0.5], Vec3::NEG_Z);
    near([0.75, 0.5], Vec3::X);
    near([0.25, 0.5], Vec3::NEG_X);
    near([0.0, 0.5], Vec3::Z);
    near([0.3, 0.0], Vec3::Y);
    near([0.3, 1.0], Vec3::NEG_Y);
}

#[test]
fn directions_survive_both_mappings() {
    for d in random_directions(2000) {
        let back = direction_from_uv(uv_from_direction(d));
        assert!((back - d).length() < 2e-6, "{d} became {back}");
        let (face, st) = Face::of(d);
        assert!(st.min_element() >= 0.0 && st.max_element() <= 1.0);
        let back = face.direction(st).normalize();
        assert!((back - d).length() < 1e-6, "{d} became {back} on {face:?}");
    }
    for d in [Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z] {
        assert!((direction_from_uv(uv_from_direction(d)) - d).length() < 1e-6);
    }
}

#[test]
fn faces_are_pictures_from_the_inside() {
    for face in Face::ALL {
        let [forward, right, down] = face.axes();
        // Seen along `forward` with its top upwards, right-handed.
        assert_eq!(forward.cross(-down), right, "{face:?}");
    }
}

#[test]
fn solid_angles_sum_to_the_sphere() {
    let sphere = 4.0 * std::f64::consts::PI;
    for (w, h) in [(2, 1), (64, 32), (1024, 512)] {
        let sum: f64 = (0..h).map(|row| f64::from(w) * solid_angle(w, h, row)).sum();
        assert!((sum - sphere).abs() < 1e-10 * sphere, "{w}×{h}: {sum}");
    }
    for (size, edge_centred) in [(1, false), (16, false), (33, true)] {
        let cube = Cube { size, faces: Default::default(), edge_centred };
        let face: f64 = (0..size * size).map(|i| cube.solid_angle(i % size, i / size)).sum();
        assert!((6.0 * face - sphere).abs() < 1e-10 * sphere, "{size}: {face}");
    }
}

#[test]
fn a_constant_stays_a_constant() {
    let radiance = Vec3::new(0.25, 3.0, 17.5);
    let cube = Cube::from_environment(&latlong(32, 16, |_| radiance), 8);
    let near = |p: &Vec3| relative(*p, radiance) < 1e-6;
    assert!(cube.faces.iter().flatten().all(near));
    assert!(cube.to_latlong("back").pixels.iter().all(near));
    assert!(relative(Environment::constant(radiance).mean(), radiance) < 1e-6);
}

#[test]
fn light_is_kept_by_conversion_both_ways() {
    // A small bright sun in a smooth sky, away from any symmetry.
    let sun = Vec3::new(0.3, 0.5, -0.6).normalize();
    let sky = |d: Vec3| smooth(d) + 500.0 * (-(d - sun).length_squared() * 120.0).exp() * Vec3::ONE;
    let made = latlong(512, 256, sky);
    let cube = Cube::from_environment(&made, 128);
    let back = cube.to_latlong("back");
    assert!(relative(cube.mean(), made.mean()) < 2e-3, "{} {}", cube.mean(), made.mean());
    assert!(relative(back.mean(), made.mean()) < 2e-3, "{} {}", back.mean(), made.mean());
    for d in random_directions(500) {
        assert!(relative(back.radiance(d), sky(d)) < 0.1, "{d}: {} {}", back.radiance(d), sky(d));
    }
}

#[test]
fn rotation_turns_the_environment_and_scale_multiplies() {
    // Bright where the image's centre looks: −Z.
    let lamp = |d: Vec3| Vec3::splat(if d.z < -0.9 { 8.0 } else { 0.0 });
    let still = latlong(128, 64, lamp);
    assert_eq!(still.radiance(Vec3::NEG_Z), Vec3::splat(8.0));
    // A quarter turn counter-clockwise, seen from above, brings −Z to −X.
    let turned = Environment { rotation: PI / 2.0, scale: 0.5, ..still };
    assert_eq!(turned.radiance(Vec3::NEG_X), Vec3::splat(4.0));
    assert_eq!(turned.radiance(Vec3::NEG_Z), Vec3::ZERO);
    assert_eq!(turned.radiance(Vec3::X), Vec3::ZERO);
}

#[test]
fn lookup_is_smooth_over_the_seam_and_the_poles() {
    let made = latlong(256, 128, smooth);
    for d in random_directions(500).into_iter().chain([Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::new(1e-4, 0.0, 1.0)]) {
        assert!(relative(made.radiance(d), smooth(d)) < 2e-3, "{d}");
    }
}

/// A picture of a cube in some layout: `at` gives column and row of a face and whether it stands on its head.
fn layout(columns: u32, rows: u32, at: fn(Face) -> (u32, u32, bool)) -> Layers {
    let size = 24;
    let (w, h) = (columns * size, rows * size);
    let mut data = vec![0.0; (w * h * 3) as usize];
    for face in Face::ALL {
        let (column, row, turned) = at(face);
        for y in 0..size {
            for x in 0..size {
                let (px, py) = if turned { (size - 1 - x, size - 1 - y) } else { (x, y) };
                let st = (Vec2::new(x as f32, y as f32) + 0.5) / size as f32;
                let pixel = ((row * size + py) * w + column * size + px) as usize;
                data[3 * pixel..3 * pixel + 3].copy_from_slice(&smooth(face.direction(st).normalize()).to_array());
            }
        }
    }
    Layers::rgb(w, h, data)
}

#[test]
fn all_cube_layouts_give_the_same_sky() {
    let horizontal = |face| match face {
        Face::Px => (2, 1, false),
        Face::Nx => (0, 1, false),
        Face::Py => (1, 0, false),
        Face::Ny => (1, 2, false),
        Face::Pz => (1, 1, false),
        Face::Nz => (3, 1, false),
    };
    let vertical = |face| match face {
        Face::Nz => (1, 3, true),
        Face::Px => (2, 1, false),
        Face::Nx => (0, 1, false),
        Face::Py => (1, 0, false),
        Face::Ny => (1, 2, false),
        Face::Pz => (1, 1, false),
    };
    let pictures = [
        layout(6, 1, |face| (face as u32, 0, false)),
        layout(1, 6, |face| (0, face as u32, false)),
        layout(4, 3, horizontal),
        layout(3, 4, vertical),
    ];
    for picture in pictures {
        let (found, notes) = from_picture(&picture, "cube", &Limits::default()).unwrap();
        assert!(notes.is_empty());
        for d in random_directions(300) {
            let (w, h) = (picture.width, picture.height);
            assert!(relative(found.radiance(d), smooth(d)) < 0.03, "{w}×{h}, {d}: {} {}", found.radiance(d), smooth(d));
        }
    }
}

#[test]
fn six_files_in_a_folder_are_a_cube() {
    let folder = tempfile::tempdir().unwrap();
    for (face, name) in Face::ALL.into_iter().zip(["px", "nx", "py", "ny", "pz", "nz"]) {
        let st = |i: u32| (Vec2::new((i % 16) as f32, (i / 16) as f32) + 0.5) / 16.0;
        let data = (0..256).flat_map(|i| smooth(face.direction(st(i)).normalize()).to_array()).collect();
        let path = folder.path().join(format!("{name}.pfm"));
        image::write(path, &Layers::rgb(16, 16, data), &WriteOptions::default()).unwrap();
    }
    let (found, _) = load(folder.path(), &Limits::default()).unwrap();
    for d in random_directions(200) {
        assert!(relative(found.radiance(d), smooth(d)) < 0.05, "{d}");
    }
    std::fs::remove_file(folder.path().join("ny.pfm")).unwrap();
    let error = load(folder.path(), &Limits::default()).unwrap_err().to_string();
    assert!(error.contains("no face ny or negy"), "{error}");
}

#[test]
fn numbers_that_are_no_radiance_are_repaired_with_a_note() {
    let mut data = vec![1.0; 4 * 2 * 3];
    (data[4], data[7], data[8]) = (f32::NAN, f32::INFINITY, -2.0);
    let (found, notes) = from_picture(&Layers::rgb(4, 2, data), "odd", &Limits::default()).unwrap();
    assert_eq!(found.pixels[1], Vec3::new(1.0, 0.0, 1.0));
    assert_eq!(found.pixels[2], Vec3::new(1.0, 65504.0, 0.0));
    assert_eq!((notes.len(), notes[0].kind), (1, NoteKind::Repaired));
    assert!(notes[0].text.contains("first in pixel (1, 0)"), "{}", notes[0].text);
}

#[test]
fn other_shapes_are_refused() {
    let error = from_picture(&Layers::rgb(5, 3, vec![1.0; 45]), "odd", &Limits::default()).unwrap_err().to_string();
    assert!(error.contains("5×3 pixels are no environment") && error.contains("2 : 1"), "{error}");
}

/// The same surroundings are in the library's collection as a cube and as a latitude-longitude image.
#[test]
fn both_forms_of_the_same_surroundings_agree() {
    for name in ["Kerner", "Orientation"] {
        let kind = if name == "Kerner" { "Env" } else { "" };
        let file = |form: &str| asset(&format!("{name}{kind}{form}.exr"));
        let (Some(cube), Some(latlong)) = (file("Cube"), file("LatLong")) else { return };
        let (cube, _) = load(&cube, &Limits::default()).unwrap();
        let (latlong, _) = load(&latlong, &Limits::default()).unwrap();
        assert!(relative(cube.mean(), latlong.mean()) < 0.02, "{name}: {} {}", cube.mean(), latlong.mean());
        let directions = random_directions(3000);
        let error = |turn: f32| {
            let turn = glam::Quat::from_rotation_y(turn);
            let differences =
                directions.iter().map(|&d| (cube.radiance(turn * d) - latlong.radiance(d)).abs().element_sum());
            differences.sum::<f32>() / directions.len() as f32
        };
        // Far better than with the cube turned a little, or by any quarter turn.
        for turn in [0.1, -0.1, PI / 2.0, PI, -PI / 2.0] {
            assert!(error(0.0) < 0.5 * error(turn), "{name}: {} against {} turned by {turn}", error(0.0), error(turn));
        }
    }
}

#[test]
fn all_shared_environments_are_read() {
    let Some(folder) = asset("uffizi_256.hdr").and_then(|path| path.parent().map(Path::to_path_buf)) else { return };
    let mut count = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "hdr" || e == "exr") {
            let (found, _) = load(&path, &Limits::default()).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!((found.width, found.pixels.len() as u32), (2 * found.height, found.width * found.height));
            let mean = found.mean();
            assert!(mean.is_finite() && mean.min_element() > 0.0, "{}: {mean}", path.display());
            count += 1;
        }
    }
    assert!(count >= 10, "{count}");
}
