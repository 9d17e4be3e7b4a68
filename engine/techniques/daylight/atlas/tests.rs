//! Shared test scenes and checks, and the tests of small scenes.

use std::collections::{HashMap, HashSet};

use glam::{Mat4, Vec2, Vec3};

use super::*;

/// A mesh that owns its data.
#[derive(Clone, Default)]
pub(super) struct Mesh {
    pub(super) positions: Vec<Vec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) uv2: Option<Vec<Vec2>>,
}

impl Mesh {
    pub(super) fn input(&self) -> MeshInput<'_> {
        MeshInput { positions: &self.positions, triangles: &self.triangles, uv2: self.uv2.as_deref() }
    }

    /// Adds a quad with its own four vertices.
    pub(super) fn quad(&mut self, corners: [Vec3; 4]) {
        let base = self.positions.len() as u32;
        self.positions.extend(corners);
        self.triangles.extend([[base, base + 1, base + 2], [base, base + 2, base + 3]]);
    }
}

pub(super) fn cuboid(size: Vec3) -> Mesh {
    let mut mesh = Mesh::default();
    for axis in 0..3 {
        for side in [0.0, 1.0] {
            let at = |u: f32, v: f32| {
                let mut p = [0.0; 3];
                p[axis] = side;
                (p[(axis + 1) % 3], p[(axis + 2) % 3]) = if side > 0.0 { (u, v) } else { (v, u) };
                Vec3::from_array(p) * size
            };
            mesh.quad([at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)]);
        }
    }
    mesh
}

pub(super) fn sphere(columns: u32, rows: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for row in 0..=rows {
        for column in 0..=columns {
            let theta = std::f32::consts::PI * row as f32 / rows as f32;
            let phi = std::f32::consts::TAU * (column % columns) as f32 / columns as f32;
            let ring = if row == rows { 0.0 } else { theta.sin() };
            mesh.positions.push(Vec3::new(ring * phi.cos(), ring * phi.sin(), theta.cos()));
        }
    }
    for row in 0..rows {
        for column in 0..columns {
            let a = row * (columns + 1) + column;
            let b = a + columns + 1;
            mesh.triangles.extend([[a, b, b + 1], [a, b + 1, a + 1]]);
        }
    }
    mesh
}

pub(super) fn at(mesh: usize, world_from_object: Mat4) -> Instance<'static> {
    Instance { mesh, world_from_object, wanted: None }
}

pub(super) fn settings(texels_per_metre: f32) -> Settings {
    Settings { texels_per_metre, ..Settings::default() }
}

/// A small generator of numbers from 0 to 1.
pub(super) struct Random(pub(super) u64);

impl Random {
    pub(super) fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1_u64 << 24) as f32
    }
}

/// Builds an atlas twice and checks everything that every atlas promises.
pub(super) fn checked(meshes: &[Mesh], instances: &[Instance], settings: &Settings) -> Atlas {
    let inputs: Vec<MeshInput> = meshes.iter().map(Mesh::input).collect();
    let atlas = build(&inputs, instances, settings).unwrap();
    assert_eq!(atlas, build(&inputs, instances, settings).unwrap(), "two runs differ");
    check(&atlas, settings);
    atlas
}

/// Checks the coverage, the gaps between the charts and the bilinear reads.
pub(super) fn check(atlas: &Atlas, settings: &Settings) {
    assert_eq!((atlas.width % 4, atlas.height % 4), (0, 0));
    assert!(atlas.width.max(atlas.height) <= settings.max_size);
    assert_eq!(atlas.corners.len(), atlas.triangle_charts.len());
    assert!(atlas.triangle_charts.iter().all(|&chart| chart < atlas.charts));
    assert_eq!(atlas.triangle_charts.iter().collect::<HashSet<_>>().len(), atlas.charts as usize);
    let covered = texels(atlas);
    let chart_at: HashMap<(u32, u32), u32> =
        covered.iter().map(|t| ((t.x, t.y), atlas.triangle_charts[t.triangle as usize])).collect();
    assert_eq!(chart_at.len(), covered.len(), "a texel comes twice");
    assert!(covered.windows(2).all(|w| (w[0].y, w[0].x) < (w[1].y, w[1].x)));
    // Two charts keep their distance. The bounds of every chart start at a block.
    let mut low: HashMap<u32, (u32, u32)> = HashMap::new();
    let reach = settings.padding as i64;
    for (&(x, y), &chart) in &chart_at {
        let corner = low.entry(chart).or_insert((x, y));
        *corner = (corner.0.min(x), corner.1.min(y));
        for (dx, dy) in [(reach, 0), (0, reach), (reach, reach), (1, 0), (0, 1), (1, 1), (1, -1), (reach, -reach)] {
            let other = ((x as i64 + dx) as u32, (y as i64 + dy) as u32);
            assert!(chart_at.get(&other).is_none_or(|&c| c == chart), "two charts are too close");
        }
        assert!(x >= settings.padding && y >= settings.padding);
        assert!(x + settings.padding < atlas.width && y + settings.padding < atlas.height);
    }
    assert!(low.values().all(|&(x, y)| x % settings.block == 0 && y % settings.block == 0), "a chart is off its block");
    let mut padded = chart_at.clone();
    for (target, source) in padding_sources(atlas.width, atlas.height, settings.padding, &covered) {
        let position = |index: u32| (index % atlas.width, index / atlas.width);
        assert!(padded.insert(position(target), chart_at[&position(source)]).is_none());
    }
    let mut random = Random(7);
    for _ in 0..20_000 {
        let triangle = ((random.next() * atlas.corners.len() as f32) as usize).min(atlas.corners.len() - 1);
        let (mut u, mut v) = (random.next(), random.next());
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        if random.next() < 0.2 {
            v = 0.0;
        }
        let [a, b, c] = atlas.corners[triangle];
        let point = a + (b - a) * u + (c - a) * v;
        let first = (point - 0.5).floor();
        for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let texel = (first.x as u32 + dx, first.y as u32 + dy);
            assert_eq!(
                padded.get(&texel),
                Some(&atlas.triangle_charts[triangle]),
                "a read leaves the chart at {point}"
            );
        }
    }
    for texel in &covered {
        let [u, v] = texel.barycentric;
        assert!(u >= 0.0 && v >= 0.0 && u + v <= 1.0);
        let [a, b, c] = atlas.corners[texel.triangle as usize];
        let point = a + (b - a) * u + (c - a) * v;
        let centre = Vec2::new(texel.x as f32 + 0.5, texel.y as f32 + 0.5);
        assert!(point.distance(centre) < 0.709, "a clamped point is too far from its texel");
    }
}

/// Gives the world area and the atlas area of every triangle of an instance.
pub(super) fn areas(atlas: &Atlas, mesh: &Mesh, instance: &Instance, base: usize) -> Vec<(f32, f32)> {
    (mesh.triangles.iter().zip(&atlas.corners[base..]))
        .map(|(triangle, flat)| {
            let [a, b, c] = triangle.map(|v| instance.world_from_object.transform_point3(mesh.positions[v as usize]));
            let flat = (flat[1] - flat[0]).perp_dot(flat[2] - flat[0]).abs() * 0.5;
            ((b - a).cross(c - a).length() * 0.5, flat)
        })
        .collect()
}

#[test]
fn a_cube_takes_six_exact_charts() {
    let mesh = cuboid(Vec3::splat(2.0));
    let instances = [at(0, Mat4::IDENTITY)];
    let atlas = checked(std::slice::from_ref(&mesh), &instances, &settings(16.0));
    assert_eq!(atlas.charts, 6);
    assert!(atlas.notes.is_empty());
    assert_eq!(texels(&atlas).len(), 6 * 32 * 32);
    for (world, flat) in areas(&atlas, &mesh, &instances[0], 0) {
        assert!((flat / (world * 256.0) - 1.0).abs() < 1.0e-3);
    }
}

#[test]
fn a_sphere_takes_few_charts() {
    let mesh = sphere(48, 24);
    let instances = [at(0, Mat4::IDENTITY)];
    let atlas = checked(std::slice::from_ref(&mesh), &instances, &settings(40.0));
    println!("sphere: {} charts, {} x {}", atlas.charts, atlas.width, atlas.height);
    assert!(atlas.charts <= 24, "{} charts", atlas.charts);
    assert!(atlas.notes.is_empty(), "{:?}", atlas.notes);
    let (world, flat) = areas(&atlas, &mesh, &instances[0], 0).iter().fold((0.0, 0.0), |s, a| (s.0 + a.0, s.1 + a.1));
    assert!((flat / (world * 1600.0) - 1.0).abs() < 0.02);
}

#[test]
fn scaled_mirrored_and_stretched_instances_keep_the_density() {
    let meshes = [cuboid(Vec3::new(1.0, 2.0, 0.5)), sphere(16, 8)];
    let instances = [
        at(0, Mat4::from_scale(Vec3::new(-1.0, 1.0, 1.0))),
        at(0, Mat4::from_rotation_y(0.7) * Mat4::from_scale(Vec3::splat(3.0))),
        at(0, Mat4::from_scale(Vec3::new(10.0, 0.1, 2.5))),
        at(0, Mat4::from_rotation_z(1.0) * Mat4::from_scale(Vec3::new(10.0, 0.1, 2.5))),
        at(1, Mat4::from_scale(Vec3::new(2.0, 2.0, -2.0))),
        at(0, Mat4::from_scale(Vec3::ZERO)),
    ];
    let atlas = checked(&meshes, &instances, &settings(16.0));
    let mut base = 0;
    for instance in &instances[..4] {
        let mesh = &meshes[instance.mesh];
        for (world, flat) in areas(&atlas, mesh, instance, base) {
            assert!((flat / (world * 256.0) - 1.0).abs() < 0.02, "{flat} texels for {world} m2");
        }
        base += mesh.triangles.len();
    }
    assert!(atlas.triangle_charts[12..24].iter().all(|chart| (6..12).contains(chart)));
    assert!(atlas.notes.is_empty(), "{:?}", atlas.notes);
}

#[test]
fn a_thin_wall_separates_its_sides() {
    let mesh = cuboid(Vec3::new(4.0, 0.01, 3.0));
    let atlas = checked(&[mesh], &[at(0, Mat4::IDENTITY)], &settings(16.0));
    assert_eq!(atlas.charts, 6);
    // A sheet with both windings on the same vertices has two sides as well.
    let mut sheet = Mesh::default();
    let [a, b, c, d] = [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y];
    sheet.quad([a, b, c, d]);
    sheet.quad([d, c, b, a]);
    let atlas = checked(&[sheet], &[at(0, Mat4::IDENTITY)], &settings(16.0));
    assert_eq!(atlas.charts, 2);
}

#[test]
fn degenerate_triangles_collapse() {
    let mut mesh = cuboid(Vec3::ONE);
    mesh.triangles.extend([[0, 0, 1], [2, 2, 2]]);
    mesh.positions.extend([Vec3::splat(5.0), Vec3::splat(6.0), Vec3::splat(7.0)]);
    let last = mesh.positions.len() as u32 - 1;
    mesh.triangles.push([last, last - 1, last - 2]);
    let atlas = checked(std::slice::from_ref(&mesh), &[at(0, Mat4::IDENTITY)], &settings(16.0));
    assert_eq!(atlas.charts, 7);
    assert_eq!(atlas.triangle_charts[12], atlas.triangle_charts[0]);
    assert_eq!(atlas.triangle_charts[14], 6);
    mesh.triangles.drain(..14);
    let atlas = checked(&[mesh], &[at(0, Mat4::IDENTITY)], &settings(16.0));
    assert_eq!((atlas.charts, texels(&atlas).len()), (1, 1));
}

#[test]
fn every_padding_and_block_keeps_the_charts_apart() {
    let meshes = [cuboid(Vec3::new(1.3, 0.02, 0.7)), sphere(12, 6)];
    let mut random = Random(11);
    for (padding, block) in [(2, 1), (2, 4), (3, 3), (5, 4), (8, 16)] {
        let instances: Vec<Instance> = (0..12)
            .map(|k| {
                let scale = Vec3::new(random.next() + 0.1, random.next() + 0.1, random.next() - 0.5);
                let uniform = Vec3::splat(random.next() * 3.0 + 0.01);
                at(
                    k % 2,
                    Mat4::from_rotation_x(random.next()) * Mat4::from_scale(if k % 3 == 0 { scale } else { uniform }),
                )
            })
            .collect();
        let wanted = Settings { padding, block, ..settings(2.0 + random.next() * 40.0) };
        checked(&meshes, &instances, &wanted);
    }
}

#[test]
fn places_of_a_texel_are_spread_over_the_part_of_it_that_charts_cover() {
    // The lower left half of a square, and a triangle that touches none of the texels below.
    let corners = [
        [Vec2::new(1.0, 1.0), Vec2::new(5.0, 1.0), Vec2::new(1.0, 5.0)],
        [Vec2::new(7.0, 7.0), Vec2::new(8.0, 7.0), Vec2::new(7.0, 8.0)],
    ];
    let at = |texel| -> Vec<Vec2> {
        let point = |(triangle, [u, v]): (u32, [f32; 2])| {
            let [a, b, c] = corners[triangle as usize];
            a + (b - a) * u + (c - a) * v
        };
        spread(&corners, &[0, 1], texel).into_iter().map(point).collect()
    };
    let inside = at([1, 1]);
    assert_eq!(inside.len(), 16);
    let off = |p: &Vec2| p.distance(Vec2::splat(1.5));
    assert!(inside.iter().all(|p| (p - Vec2::splat(1.5)).abs().max_element() < 0.376), "{inside:?}");
    assert!(inside.is_sorted_by(|a, b| off(a) <= off(b) + 1e-5), "{inside:?}");
    // Grid points beyond the long edge move onto it, and each place comes once.
    let cut = at([3, 2]);
    assert!(cut.iter().all(|p| p.x + p.y <= 6.0 + 1e-5), "{cut:?}");
    assert!(cut.iter().any(|p| p.x + p.y < 5.6) && cut.len() < 16, "{cut:?}");
    assert_eq!(at([5, 5]), []);
}

#[test]
fn charts_without_a_wanted_triangle_are_left_out() {
    // A cube of two metres has six charts of two triangles each.
    let cube = cuboid(Vec3::splat(2.0));
    let count = cube.triangles.len();
    let wanted: Vec<bool> = (0..count).map(|triangle| triangle == 3).collect();
    let back = Instance { wanted: Some(&wanted), ..at(0, Mat4::IDENTITY) };
    let inputs = [cube.input()];
    let atlas = build(&inputs, &[at(0, Mat4::IDENTITY), back], &settings(4.0)).unwrap();
    let whole = build(&inputs, &[at(0, Mat4::IDENTITY), at(0, Mat4::IDENTITY)], &settings(4.0)).unwrap();
    assert_eq!((atlas.charts, whole.charts), (7, 12));
    let placed: Vec<usize> = (count..2 * count).filter(|t| atlas.corners[*t][0].is_finite()).collect();
    assert!(placed.len() == 2 && placed.contains(&(count + 3)), "{placed:?}");
    for triangle in count..2 * count {
        assert_eq!(atlas.triangle_charts[triangle] == u32::MAX, !placed.contains(&triangle));
    }
    let of = |atlas: &Atlas| texels(atlas).len();
    assert_eq!(of(&atlas) * 12, of(&whole) * 7);
    assert!(texels(&atlas).iter().all(|texel| atlas.corners[texel.triangle as usize][0].is_finite()));
    let none = Instance { wanted: Some(&wanted[1..]), ..back };
    assert!(build(&inputs, &[none], &settings(4.0)).unwrap_err().contains("chooses among 11 triangles"));
}
