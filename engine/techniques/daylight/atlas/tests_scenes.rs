//! The tests of errors, uv2 and large scenes.

use std::time::Instant;

use glam::{Mat4, Vec2, Vec3};

use super::{
    tests::{Mesh, Random, areas, at, checked, cuboid, settings, sphere},
    *,
};

fn error(meshes: &[Mesh], instances: &[Instance], settings: &Settings) -> String {
    let inputs: Vec<MeshInput> = meshes.iter().map(Mesh::input).collect();
    let error = build(&inputs, instances, settings).unwrap_err();
    println!("{error}");
    assert!(error.ends_with('.'));
    error
}

/// A square of hills with two triangles for every cell.
fn terrain(cells: u32, size: f32) -> Mesh {
    let mut mesh = Mesh::default();
    for y in 0..=cells {
        for x in 0..=cells {
            let (u, v) = (x as f32 / cells as f32, y as f32 / cells as f32);
            let height = 0.04 * (u * 21.0).sin() * (v * 17.0).cos() + 0.004 * (u * 150.0 + v * 90.0).sin();
            mesh.positions.push(Vec3::new(u, v, height) * size);
        }
    }
    for y in 0..cells {
        for x in 0..cells {
            let a = y * (cells + 1) + x;
            let b = a + cells + 1;
            mesh.triangles.extend([[a, a + 1, b + 1], [a, b + 1, b]]);
        }
    }
    mesh
}

#[test]
fn bad_input_is_an_error() {
    let cube = cuboid(Vec3::ONE);
    let here = [at(0, Mat4::IDENTITY)];
    assert!(error(&[], &[], &settings(16.0)).contains("no triangles"));
    assert!(error(std::slice::from_ref(&cube), &[], &settings(16.0)).contains("no triangles"));
    assert!(error(&[Mesh::default()], &here, &settings(16.0)).contains("no triangles"));
    let mut bad = cube.clone();
    bad.positions[3].y = f32::NAN;
    assert!(error(&[bad], &here, &settings(16.0)).contains("vertex 3"));
    let mut bad = cube.clone();
    bad.triangles[2][1] = 99;
    assert!(error(&[bad], &here, &settings(16.0)).contains("triangle 2"));
    let cubes = [cube];
    assert!(error(&cubes, &[at(1, Mat4::IDENTITY)], &settings(16.0)).contains("mesh 1"));
    assert!(error(&cubes, &[at(0, Mat4::from_scale(Vec3::splat(f32::NAN)))], &settings(1.0)).contains("transform"));
    assert!(error(&cubes, &here, &settings(0.0)).contains("density"));
    assert!(error(&cubes, &here, &Settings { padding: 1, ..settings(1.0) }).contains("padding"));
    assert!(error(&cubes, &here, &Settings { block: 0, ..settings(1.0) }).contains("block"));
    assert!(error(&cubes, &here, &Settings { max_size: 0, ..settings(1.0) }).contains("size"));
    assert!(error(&cubes, &here, &Settings { unwrap_seconds_per_mesh: f64::NAN, ..settings(1.0) }).contains("time"));
}

#[test]
fn a_small_atlas_names_the_density_that_fits() {
    let meshes = [cuboid(Vec3::new(20.0, 12.0, 3.0)), sphere(16, 8)];
    let instances = [at(0, Mat4::IDENTITY), at(1, Mat4::from_scale(Vec3::splat(2.0)))];
    for density in [64.0, 1000.0, 1.0e12] {
        let small = Settings { max_size: 512, ..settings(density) };
        let message = error(&meshes, &instances, &small);
        let named = message.split("texels_per_metre to ").nth(1).unwrap();
        let named: f32 = named.split_whitespace().next().unwrap().parse().unwrap();
        let atlas = checked(&meshes, &instances, &Settings { texels_per_metre: named, ..small });
        assert!(atlas.width.max(atlas.height) > 440, "{} x {}", atlas.width, atlas.height);
    }
    let many: Vec<Instance> = (0..2000).map(|_| at(0, Mat4::IDENTITY)).collect();
    let message = error(&meshes, &many, &Settings { max_size: 512, ..settings(16.0) });
    assert!(message.contains("any density"));
}

#[test]
fn a_valid_uv2_is_kept() {
    let mut mesh = Mesh::default();
    for k in 0..4 {
        let (x, y) = (k as f32, if k % 2 == 0 { 0.0 } else { 0.5 });
        let (x2, y2) = (x + 1.0, 0.5 - y);
        mesh.quad([Vec3::new(x, 0.0, y), Vec3::new(x2, 0.0, y2), Vec3::new(x2, 2.0, y2), Vec3::new(x, 2.0, y)]);
    }
    let mut uv2 = Vec::new();
    for k in 0..4 {
        let (u, v) = (k as f32 * 0.2 + 0.1, (k + 1) as f32 * 0.2 + 0.1);
        uv2.extend([Vec2::new(u, 0.2), Vec2::new(v, 0.2), Vec2::new(v, 0.6), Vec2::new(u, 0.6)]);
    }
    mesh.uv2 = Some(uv2.clone());
    let instances = [at(0, Mat4::IDENTITY)];
    let atlas = checked(std::slice::from_ref(&mesh), &instances, &settings(32.0));
    assert!(atlas.notes.is_empty(), "{:?}", atlas.notes);
    assert_eq!(atlas.charts, 1);
    for (world, flat) in areas(&atlas, &mesh, &instances[0], 0) {
        assert!((flat / (world * 1024.0) - 1.0).abs() < 0.05);
    }
    let ignored = checked(std::slice::from_ref(&mesh), &instances, &Settings { use_uv2: false, ..settings(32.0) });
    assert_ne!(ignored.charts, 1);
    // An overlap, a missing area, a wrong length and a bad number are refused with a note.
    let mut folded = uv2.clone();
    for point in &mut folded[8..] {
        point.x -= 0.4;
    }
    let mut broken = uv2.clone();
    broken[5].x = f32::NAN;
    let flat = vec![Vec2::ZERO; uv2.len()];
    for (bad, word) in
        [(folded, "more than once"), (flat, "no area"), (uv2[1..].to_vec(), "entries"), (broken, "finite")]
    {
        mesh.uv2 = Some(bad);
        let atlas = checked(std::slice::from_ref(&mesh), &instances, &settings(32.0));
        println!("{:?}", atlas.notes);
        assert_eq!(atlas.notes.len(), 1);
        assert!(atlas.notes[0].contains(word));
        assert_eq!(atlas.corners, ignored.corners);
    }
}

/// Separate triangles of several sizes.
fn soup(count: u32) -> Mesh {
    let mut random = Random(3);
    let mut mesh = Mesh::default();
    let mut point = |scale: f32| Vec3::new(random.next(), random.next(), random.next()) * scale;
    for k in 0..count {
        let base = point(20.0);
        let size = if k % 50 == 0 { 4.0 } else { 0.3 };
        mesh.positions.extend([base, base + point(size), base + point(size)]);
        mesh.triangles.push([k * 3, k * 3 + 1, k * 3 + 2]);
    }
    mesh
}

#[test]
fn a_soup_of_triangles_fits() {
    let mesh = soup(3000);
    let instances = [at(0, Mat4::IDENTITY)];
    let atlas = checked(std::slice::from_ref(&mesh), &instances, &settings(16.0));
    println!("soup: {} charts, {} x {}", atlas.charts, atlas.width, atlas.height);
    assert_eq!(atlas.charts, 3000);
    for (world, flat) in areas(&atlas, &mesh, &instances[0], 0) {
        assert!((flat - world * 256.0).abs() < 0.01 + world * 256.0 * 0.02, "{flat} texels for {world} m2");
    }
}

#[test]
fn overlapping_copies_of_a_wall_are_separate() {
    let mut mesh = cuboid(Vec3::ONE);
    let copy = mesh.clone();
    mesh.positions.extend(&copy.positions);
    mesh.triangles.extend(&copy.triangles);
    checked(&[mesh], &[at(0, Mat4::IDENTITY)], &settings(16.0));
}

#[test]
fn a_terrain_of_50_000_triangles_is_unwrapped() {
    let mesh = terrain(158, 50.0);
    let start = Instant::now();
    let atlas =
        build(&[mesh.input()], &[at(0, Mat4::IDENTITY)], &Settings { max_size: 8192, ..settings(8.0) }).unwrap();
    println!("terrain: {} triangles in {:.1?}", mesh.triangles.len(), start.elapsed());
    println!("terrain: {} charts, {} x {}, {:?}", atlas.charts, atlas.width, atlas.height, atlas.notes);
    assert!(atlas.charts < 50, "{} charts", atlas.charts);
    assert!(atlas.notes.is_empty());
    let start = Instant::now();
    let covered = texels(&atlas);
    println!("terrain: {} texels in {:.1?}", covered.len(), start.elapsed());
    let start = Instant::now();
    let pairs = padding_sources(atlas.width, atlas.height, 4, &covered);
    println!("terrain: {} padding texels in {:.1?}", pairs.len(), start.elapsed());
    let start = Instant::now();
    let small = Settings { unwrap_seconds_per_mesh: 0.0, ..settings(8.0) };
    let atlas = build(&[mesh.input()], &[at(0, Mat4::IDENTITY)], &small).unwrap();
    println!(
        "terrain: {} projected charts in {:.1?}, {} x {}",
        atlas.charts,
        start.elapsed(),
        atlas.width,
        atlas.height
    );
    assert!(atlas.charts < 500, "{} charts", atlas.charts);
}

#[test]
fn a_mesh_over_the_budget_takes_projections() {
    let meshes = [terrain(60, 20.0), sphere(48, 24)];
    let instances = [at(0, Mat4::IDENTITY), at(1, Mat4::from_translation(Vec3::Z))];
    let small = Settings { unwrap_seconds_per_mesh: 0.0, ..settings(16.0) };
    let atlas = checked(&meshes, &instances, &small);
    println!("projections: {} charts, {} x {}, {:?}", atlas.charts, atlas.width, atlas.height, atlas.notes);
    assert_eq!(atlas.notes.len(), 2);
    assert!(atlas.charts < 100, "{} charts", atlas.charts);
}

#[test]
#[ignore = "it measures the unwrap library"]
fn the_unwrap_library_takes_time() {
    let smooth = |cells: u32| {
        let mut mesh = terrain(cells, 50.0);
        for p in &mut mesh.positions {
            p.z = 3.0 * (p.x * 0.15).sin() * (p.y * 0.2).cos();
        }
        mesh
    };
    let scenes = [
        ("terrain", terrain(50, 50.0)),
        ("terrain", terrain(158, 50.0)),
        ("smooth", smooth(50)),
        ("smooth", smooth(158)),
        ("smooth", smooth(223)),
        ("soup", soup(100_000)),
        ("sphere", sphere(100, 25)),
        ("sphere", sphere(316, 79)),
    ];
    for (name, mesh) in scenes {
        let start = Instant::now();
        let long = Settings { unwrap_seconds_per_mesh: 1.0e6, max_size: 8192, ..settings(8.0) };
        let atlas = build(&[mesh.input()], &[at(0, Mat4::IDENTITY)], &long).unwrap();
        println!(
            "{name}: {} triangles in {:.2?}, {} charts, {} x {}, {:?}",
            mesh.triangles.len(),
            start.elapsed(),
            atlas.charts,
            atlas.width,
            atlas.height,
            atlas.notes
        );
    }
}
