//! What holds for every built-in scene.

#[path = "hall/tests.rs"]
mod hall;
#[path = "parlour/tests.rs"]
mod parlour;

use super::{NAMES, cornell, furnace, load};
use glam::{Mat4, Vec3};
use lucerna::{
    ErrorKind,
    scene::{Primitive, Projection, Scene},
};
use std::{
    collections::{BTreeSet, HashMap, hash_map::DefaultHasher},
    hash::{Hash, Hasher},
    sync::OnceLock,
};

/// Every scene by name, built once for all tests.
fn scenes() -> &'static [(&'static str, Scene)] {
    static SCENES: OnceLock<Vec<(&'static str, Scene)>> = OnceLock::new();
    SCENES.get_or_init(|| NAMES.iter().map(|name| (*name, load(name).unwrap())).collect())
}

/// Triangles as drawn (instances counted) that each scene must have.
const TRIANGLES: &[(&str, std::ops::RangeInclusive<usize>)] = &[
    ("cornell", 42..=42),
    ("cornell-area", 42..=42),
    ("furnace", 12..=12),
    ("furnace-sphere", 9024..=9024),
    ("primitives", 10_000..=25_000),
    ("teapot", 15_000..=40_000),
    ("office", 20_000..=22_000),
    // 190 000 to within a twentieth.
    ("conference", 180_500..=199_500),
    ("parlour", 20_000..=80_000),
    ("garage", 50_000..=150_000),
    ("hall", 180_000..=200_000),
    ("street", 150_000..=300_000),
    ("figure", 20_000..=60_000),
    ("shadows", 20_000..=60_000),
    ("shadows-moving", 20_000..=90_000),
];

fn world(scene: &Scene) -> Vec<Mat4> {
    let mut world: Vec<Mat4> = Vec::new();
    for node in &scene.nodes {
        let parent = node.parent.map_or(Mat4::IDENTITY, |p| world[p as usize]);
        world.push(parent * node.local.matrix());
    }
    world
}

/// World-space corners of every drawn triangle, and its primitive.
fn triangles(scene: &Scene) -> Vec<([Vec3; 3], &Primitive)> {
    let mut out = Vec::new();
    for (node, matrix) in scene.nodes.iter().zip(world(scene)) {
        for primitive in node.mesh.iter().flat_map(|m| &scene.meshes[*m as usize].primitives) {
            for c in primitive.indices.chunks_exact(3) {
                out.push(([0, 1, 2].map(|k| matrix.transform_point3(primitive.positions[c[k] as usize])), primitive));
            }
        }
    }
    out
}

fn bounds(scene: &Scene) -> (Vec3, Vec3) {
    triangles(scene)
        .iter()
        .flat_map(|(c, _)| c)
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(*p), high.max(*p)))
}

/// Distance along the ray to the nearest triangle (Möller and Trumbore 1997).
fn cast(triangles: &[([Vec3; 3], &Primitive)], origin: Vec3, direction: Vec3) -> Option<f32> {
    let hits = triangles.iter().filter_map(|([a, b, c], _)| {
        let (e1, e2) = (*b - *a, *c - *a);
        let p = direction.cross(e2);
        let det = e1.dot(p);
        if det.abs() < 1e-12 {
            return None;
        }
        let s = origin - *a;
        let u = s.dot(p) / det;
        let q = s.cross(e1);
        let v = direction.dot(q) / det;
        let t = e2.dot(q) / det;
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0).then_some(t)
    });
    hits.min_by(f32::total_cmp)
}

fn fingerprint(scene: &Scene) -> u64 {
    let mut hasher = DefaultHasher::new();
    let mut floats = |values: &[f32]| values.iter().for_each(|v| v.to_bits().hash(&mut hasher));
    for primitive in scene.meshes.iter().flat_map(|m| &m.primitives) {
        primitive.positions.iter().chain(&primitive.normals).for_each(|p| floats(&p.to_array()));
        primitive.uvs.iter().flatten().for_each(|p| floats(&p.to_array()));
    }
    scene.nodes.iter().for_each(|n| floats(&n.local.matrix().to_cols_array()));
    for texture in &scene.textures {
        texture.rgba.hash(&mut hasher);
    }
    hasher.finish()
}

#[test]
fn counts_are_the_stated_ones() {
    assert_eq!(TRIANGLES.iter().map(|(name, _)| *name).collect::<Vec<_>>(), NAMES);
    for ((name, range), (_, scene)) in TRIANGLES.iter().zip(scenes()) {
        let count = triangles(scene).len();
        assert!(range.contains(&count), "{name} has {count} triangles, not {range:?}");
        assert_eq!(&scene.name, name);
    }
}

#[test]
fn geometry_is_sound() {
    for (name, scene) in scenes() {
        let (mut all, mut degenerate, mut against) = (0, 0, 0);
        for (mesh, primitive) in scene.meshes.iter().flat_map(|m| m.primitives.iter().map(move |p| (m, p))) {
            let at = format!("{name}, mesh {:?}", mesh.name);
            let count = primitive.positions.len();
            assert!(!primitive.indices.is_empty() && primitive.indices.len() % 3 == 0, "{at}: no triangle list");
            assert!(primitive.indices.iter().all(|i| (*i as usize) < count), "{at}: an index has no vertex");
            assert_eq!((primitive.normals.len(), primitive.tangents.len()), (count, count), "{at}");
            assert!(primitive.uvs.iter().all(|set| set.len() == count), "{at}: uvs");
            assert!(primitive.colors.is_empty() || primitive.colors.len() == count, "{at}: colours");
            assert!(primitive.positions.iter().all(|p| p.is_finite()), "{at}: a position is not finite");
            assert!(primitive.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-4), "{at}: a normal is not unit");
            let material = &scene.materials[primitive.material as usize];
            if material.normal_texture.is_some() {
                for (n, t) in primitive.normals.iter().zip(&primitive.tangents) {
                    assert!((t.truncate().length() - 1.0).abs() < 1e-4 && t.w.abs() == 1.0, "{at}: tangent {t}");
                    assert!(t.truncate().dot(*n).abs() < 1e-3, "{at}: tangent {t} is not in the plane of {n}");
                }
            }
            for c in primitive.indices.chunks_exact(3) {
                let [a, b, d] = [0, 1, 2].map(|k| primitive.positions[c[k] as usize]);
                let cross = (b - a).cross(d - a);
                let longest = (b - a).length().max((d - b).length()).max((a - d).length());
                all += 1;
                if cross.length() <= 1e-5 * longest * longest {
                    degenerate += 1;
                } else if !material.double_sided {
                    let mean: Vec3 = c.iter().map(|i| primitive.normals[*i as usize]).sum();
                    if mean.dot(cross) <= 0.0 {
                        println!("{at}: triangle at {a} is wound against its normals");
                        against += 1;
                    }
                }
            }
        }
        assert!(degenerate * 1000 <= all, "{name}: {degenerate} of {all} triangles are degenerate");
        // Smooth bodies have a few slivers in sharp folds (between fingers, in the hedge).
        assert!(against * 2000 <= all, "{name}: {against} of {all} triangles are wound against their normals");
    }
}

#[test]
fn scenes_are_valid_and_have_nothing_to_spare() {
    for (name, scene) in scenes() {
        scene.validate().unwrap_or_else(|error| panic!("{name}: {error}"));
        for material in &scene.materials {
            assert!((0.0..=1.0).contains(&material.base_color.truncate().max_element()), "{name}: {}", material.name);
        }
        let used: BTreeSet<u32> = scene.meshes.iter().flat_map(|m| &m.primitives).map(|p| p.material).collect();
        assert_eq!(used.len(), scene.materials.len(), "{name}: materials that nothing uses");
    }
}

#[test]
fn cameras_stand_free_and_look_at_something() {
    for (name, scene) in scenes() {
        let names: BTreeSet<&str> = scene.cameras.iter().map(|c| c.name.as_str()).collect();
        assert!(names.len() >= 3 && names.len() == scene.cameras.len(), "{name}: cameras {names:?}");
        let triangles = triangles(scene);
        let (low, high) = bounds(scene);
        let reach = (high - low).length();
        for (node, matrix) in scene.nodes.iter().zip(world(scene)).filter(|(n, _)| n.camera.is_some()) {
            let eye = matrix.w_axis.truncate();
            let place = format!("{name}, camera {:?}", node.name);
            assert!((eye - (low + high) * 0.5).length() < 1.5 * reach, "{place} stands far outside at {eye}");
            let hit = cast(&triangles, eye, -matrix.z_axis.truncate());
            let camera = &scene.cameras[node.camera.unwrap() as usize];
            let Projection::Perspective { znear, zfar, .. } = camera.projection else { panic!("{place}") };
            let hit = hit.unwrap_or_else(|| panic!("{place} looks at nothing"));
            assert!(hit > 4.0 * znear && hit < zfar.unwrap(), "{place} sees the nearest surface at {hit} m");
            assert!(matrix.y_axis.y > 0.0, "{place} stands on its head");
        }
    }
}

#[test]
fn the_same_scene_every_time() {
    for (name, scene) in scenes() {
        assert_eq!(fingerprint(scene), fingerprint(&load(name).unwrap()), "{name}");
    }
}

#[test]
fn skin_weights_sum_to_one() {
    for (name, scene) in scenes() {
        for primitive in scene.meshes.iter().flat_map(|m| &m.primitives) {
            let Some(first) = primitive.weights.first() else { continue };
            for vertex in 0..first.len() {
                let sum: f32 = primitive.weights.iter().map(|set| set[vertex].element_sum()).sum();
                assert!((sum - 1.0).abs() < 1e-5, "{name}: weights of vertex {vertex} sum to {sum}");
            }
        }
    }
}

#[test]
fn unknown_names_are_a_usage_error_that_helps() {
    let error = load("cornel").unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Usage);
    let text = error.to_string();
    assert!(text.contains("Did you mean \"cornell\"?"), "{text}");
    assert!(NAMES.iter().all(|name| text.contains(name)), "{text}");
    assert!(!load("zzzzzzzzzzzz").unwrap_err().to_string().contains("mean"));
    assert_eq!(load("").unwrap_err().kind(), ErrorKind::Usage);
}

/// Edges of a closed surface belong to two triangles that pass them in opposite ways.
fn open_edges(scene: &Scene, mesh: u32) -> usize {
    let mut edges: HashMap<([i32; 3], [i32; 3]), i32> = HashMap::new();
    for primitive in &scene.meshes[mesh as usize].primitives {
        for c in primitive.indices.chunks_exact(3) {
            for k in 0..3 {
                let [a, b] = [c[k], c[(k + 1) % 3]].map(|i| super::kit::place(primitive.positions[i as usize]));
                *edges.entry((a, b)).or_default() += 1;
                *edges.entry((b, a)).or_default() -= 1;
            }
        }
    }
    edges.values().filter(|balance| **balance > 0).count()
}

fn volume(scene: &Scene, mesh: u32) -> f32 {
    let primitives = &scene.meshes[mesh as usize].primitives;
    let six_fold = primitives.iter().flat_map(|p| p.indices.chunks_exact(3).map(move |c| (p, c))).map(|(p, c)| {
        let [a, b, d] = [0, 1, 2].map(|k| p.positions[c[k] as usize]);
        a.dot(b.cross(d))
    });
    six_fold.sum::<f32>() / 6.0
}

#[test]
fn solids_are_closed_and_turned_outward() {
    let scene = load("primitives").unwrap();
    for (mesh, known) in scene.meshes.iter().enumerate() {
        assert_eq!(open_edges(&scene, mesh as u32), 0, "{:?} has open edges", known.name);
        assert!(volume(&scene, mesh as u32) > 1e-4, "{:?} is inside out", known.name);
    }
    let find = |name: &str| scene.meshes.iter().position(|m| m.name == name).unwrap() as u32;
    let near = |name: &str, expected: f32| {
        let found = volume(&scene, find(name));
        assert!((found / expected - 1.0).abs() < 0.015, "{name}: {found} m³, not {expected}");
    };
    let pi = std::f32::consts::PI;
    near("large sphere", 4.0 / 3.0 * pi * 0.125);
    near("cone", pi * 0.42 * 0.42 * 1.15 / 3.0);
    near("ring", 2.0 * pi * pi * 0.36 * 0.14 * 0.14);
    near("cylinder", pi * 0.04 * 0.85);
    near("pipe", pi * (0.09 - 0.04) * 0.34);
    near("capsule", pi * 0.0225 * 0.34 + 4.0 / 3.0 * pi * 0.003_375);
    near("pyramid", 0.62 * 0.62 * 0.55 / 3.0);
    near("octahedron", 4.0 / 3.0 * 0.24f32.powi(3));
    let inside = load("furnace").unwrap();
    assert!((volume(&inside, 0) + 8.0).abs() < 1e-5, "the furnace is seen from within");
}

#[test]
fn cornell_box_measures_what_was_published() {
    let scene = &load("cornell").unwrap();
    let (low, high) = bounds(scene);
    assert_eq!(low, Vec3::ZERO);
    assert!((high - Vec3::new(0.556, 0.5488, 0.5592)).abs().max_element() < 1e-6, "{high}");
    let area = |name: &str| {
        let mesh = scene.meshes.iter().find(|m| m.name == name).unwrap();
        let p = &mesh.primitives[0];
        let twice = p.indices.chunks_exact(3).map(|c| {
            let [a, b, d] = [0, 1, 2].map(|k| p.positions[c[k] as usize]);
            (b - a).cross(d - a).length()
        });
        twice.sum::<f32>() * 0.5
    };
    assert!((area("light") - 0.130 * 0.105).abs() < 1e-6);
    // The ceiling is its published rectangle less the lamp.
    assert!((area("ceiling") - (0.556 * 0.5592 - 0.130 * 0.105)).abs() < 1e-6);
    let block = |name: &str| scene.meshes.iter().position(|m| m.name == name).unwrap() as u32;
    // Shoelace areas of the published corners times the published heights.
    for (name, corners, height) in
        [("short block", cornell::SHORT_BLOCK, 0.165), ("tall block", cornell::TALL_BLOCK, 0.330)]
    {
        let twice: f32 =
            (0..4).map(|i| corners[i][2] * corners[(i + 1) % 4][0] - corners[i][0] * corners[(i + 1) % 4][2]).sum();
        let expected = twice.abs() * 0.5e-6 * height;
        assert_eq!(open_edges(scene, block(name)), 0);
        assert!((volume(scene, block(name)) / expected - 1.0).abs() < 1e-4, "{name}");
    }
    // The camera of the published data sees the open side fill its square film: 39.3 degrees.
    let Projection::Perspective { yfov, .. } = scene.cameras[0].projection else { panic!() };
    assert!((yfov.to_degrees() - 39.3077).abs() < 1e-3, "{}", yfov.to_degrees());
}

#[test]
fn cornell_paints_have_their_colours_under_daylight() {
    for (spectrum, expected) in [
        (cornell::WHITE, Vec3::new(0.738, 0.736, 0.740)),
        (cornell::GREEN, Vec3::new(0.068, 0.398, 0.087)),
        (cornell::RED, Vec3::new(0.490, 0.050, 0.051)),
    ] {
        let found = cornell::reflectance(&spectrum);
        assert!((found - expected).abs().max_element() < 1e-3, "{found} is not near {expected}");
    }
    assert!((cornell::reflectance(&[1.0; 76]) - Vec3::ONE).abs().max_element() < 1e-6);
    assert!((cornell::reflectance(&[0.25; 76]) - Vec3::splat(0.25)).abs().max_element() < 1e-6);
}

#[test]
fn cornell_stand_in_has_the_flux_of_the_lamp() {
    let scene = load("cornell").unwrap();
    let light = &scene.lights[0];
    let lucerna::scene::LightKind::Spot { inner, outer, .. } = light.kind else { panic!("{light:?}") };
    // Flux of glTF's squared ramp, by the midpoint rule over the cosine.
    let steps = 100_000;
    let ramp: f64 = (0..steps)
        .map(|i| {
            let cos = (f64::from(i) + 0.5) / f64::from(steps);
            let (ci, co) = (f64::from(inner.cos()), f64::from(outer.cos()));
            ((cos - co) / (ci - co)).clamp(0.0, 1.0).powi(2)
        })
        .sum::<f64>()
        / f64::from(steps);
    let spot = (light.color * light.intensity).as_dvec3() * ramp * std::f64::consts::TAU;
    let lamp = cornell::emission().as_dvec3() * std::f64::consts::PI * 0.130 * 0.105;
    assert!((spot - lamp).abs().max_element() < 1e-4 * lamp.max_element(), "{spot} W, not {lamp} W");
}

#[test]
fn furnaces_state_their_answers() {
    let scene = load("furnace").unwrap();
    let wall = &scene.materials[0];
    assert_eq!(wall.emissive, Vec3::splat(furnace::EMISSION));
    assert_eq!(wall.base_color.truncate(), Vec3::splat(furnace::ALBEDO));
    let sphere = load("furnace-sphere").unwrap();
    let sky = sphere.environment.unwrap();
    assert!(sky.pixels.iter().all(|p| *p * sky.scale == Vec3::splat(furnace::RADIANCE)));
}

#[test]
fn the_conference_room_is_closed_and_has_what_it_is_for() {
    let scene = load("conference").unwrap();
    let lamps: Vec<_> = scene.lights.iter().map(|light| light.kind).collect();
    assert!(lamps.len() == 4 && lamps.iter().all(|kind| matches!(kind, lucerna::scene::LightKind::Point { .. })));
    // Mirrors and glass are a good part of it.
    let sharp = |p: &Primitive| {
        let material = &scene.materials[p.material as usize];
        material.is_mirror() || material.transmission > 0.0
    };
    let triangles = triangles(&scene);
    let share = triangles.iter().filter(|(_, p)| sharp(p)).count() as f32 / triangles.len() as f32;
    assert!((0.1..0.6).contains(&share), "{share}");
    // Nothing leads out: from between the lamps a ray in any direction meets something.
    for i in 0..200 {
        let y = 1.0 - (i as f32 + 0.5) / 100.0;
        let (sin, cos) = (2.4 * i as f32).sin_cos();
        let r = (1.0 - y * y).sqrt();
        let hit = cast(&triangles, Vec3::new(0.0, 1.9, 0.05), Vec3::new(r * cos, y, r * sin));
        assert!(hit.is_some_and(|t| t < 7.0), "ray {i}: {hit:?}");
    }
}

#[test]
fn figure_moves_and_its_feet_hold_the_ground() {
    let scene = &load("figure").unwrap();
    let names: Vec<&str> = scene.animations.iter().map(|a| a.name.as_str()).collect();
    assert_eq!(names, ["walk", "path", "sculpture", "rings", "ball", "clock"]);
    // The path's round is a whole number of cycles, so that the figure meets itself.
    let cycles = scene.animations[1].duration() / scene.animations[0].duration();
    assert!((cycles - cycles.round()).abs() < 1e-5);
    let keys: usize = scene.animations.iter().flat_map(|a| &a.channels).map(|c| c.times.len()).sum();
    assert!(keys > 500);
    let skin = &scene.skins[0];
    let rest = world(scene);
    let skinned = scene.nodes.iter().position(|n| n.skin.is_some()).unwrap();
    for (joint, inverse) in skin.joints.iter().zip(&skin.inverse_bind) {
        // At rest the skin changes nothing.
        let moved = rest[*joint as usize] * *inverse;
        assert!((moved.w_axis - rest[skinned].w_axis).length() < 1e-5);
    }
}
