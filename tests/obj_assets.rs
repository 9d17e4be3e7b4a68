//! The OBJ scenes of the asset collection, compared with what another reader makes of them.

use crate::common;
use glam::{DVec3, Vec3};
use lucerna::scene::{LoadOptions, Scene, load};
use std::{collections::BTreeMap, path::Path};

fn area([a, b, c]: [Vec3; 3]) -> f64 {
    let [a, b, c] = [a, b, c].map(Vec3::as_dvec3);
    (b - a).cross(c - a).length() / 2.0
}

/// Area by material name, and the bounds of the corners of all triangles with area.
fn ours(scene: &Scene) -> (BTreeMap<String, f64>, [DVec3; 2]) {
    let mut areas = BTreeMap::new();
    let mut bounds = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    for primitive in scene.meshes.iter().flat_map(|mesh| &mesh.primitives) {
        let sum: &mut f64 = areas.entry(scene.materials[primitive.material as usize].name.clone()).or_default();
        for corners in primitive.indices.chunks(3) {
            let corners = [0, 1, 2].map(|c| primitive.positions[corners[c] as usize]);
            *sum += area(corners);
            grow(&mut bounds, corners);
        }
    }
    (areas, bounds)
}

fn grow(bounds: &mut [DVec3; 2], corners: [Vec3; 3]) {
    for corner in corners.map(Vec3::as_dvec3) {
        *bounds = [bounds[0].min(corner), bounds[1].max(corner)];
    }
}

fn theirs(path: &Path) -> (BTreeMap<String, f64>, [DVec3; 2]) {
    let options = tobj::LoadOptions { single_index: true, triangulate: true, ..tobj::LoadOptions::default() };
    let (models, materials) = tobj::load_obj(path, &options).unwrap();
    let materials = materials.unwrap_or_default();
    let mut areas = BTreeMap::new();
    let mut bounds = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    for model in models {
        let name = model.mesh.material_id.map_or("default".to_owned(), |id| materials[id].name.clone());
        let sum: &mut f64 = areas.entry(name).or_default();
        for corners in model.mesh.indices.chunks(3) {
            let at = |c: usize| Vec3::from_slice(&model.mesh.positions[corners[c] as usize * 3..]);
            let corners = [at(0), at(1), at(2)];
            *sum += area(corners);
            if area(corners) > 0.0 {
                grow(&mut bounds, corners);
            }
        }
    }
    (areas, bounds)
}

#[test]
fn areas_and_bounds_agree_with_another_reader() {
    let Some(assets) = common::assets() else { return };
    let mut files = 0;
    for folder in std::fs::read_dir(assets.join("scenes")).unwrap().flatten() {
        for file in std::fs::read_dir(folder.path()).unwrap().flatten() {
            let path = file.path();
            if path.extension().is_none_or(|extension| extension != "obj") {
                continue;
            }
            files += 1;
            let scene = load(&path, &LoadOptions::default()).unwrap();
            let ((areas, bounds), (want, want_bounds)) = (ours(&scene), theirs(&path));
            assert_eq!(bounds, want_bounds, "{}", path.display());
            // Where no material file is found, the other reader has no materials.
            let total = |areas: &BTreeMap<String, f64>| areas.values().sum::<f64>();
            // The other reader cuts concave polygons into fans that overlap: its area may be larger, but never smaller.
            let same = |ours: f64, theirs: f64| ours <= theirs * (1.0 + 1e-6) && ours >= theirs * 0.995;
            assert!(same(total(&areas), total(&want)), "{}: {areas:?} {want:?}", path.display());
            if want.keys().any(|name| name != "default") {
                for (name, &want) in &want {
                    assert!(same(areas[name], want), "{}: {name}: {} {want}", path.display(), areas[name]);
                }
            }
        }
    }
    assert!(files >= 14, "only {files} files were found");
}

#[test]
fn sponza_has_its_groups_and_materials() {
    let Some(assets) = common::assets() else { return };
    let scene = load(assets.join("scenes/sponza-dabrovic/sponza.obj"), &LoadOptions::default()).unwrap();
    assert_eq!((scene.meshes.len(), scene.materials.len()), (33, 20));
    assert!(scene.notes.iter().any(|note| note.text.contains("sponza.mtl")), "the missing MTL file is not noted");
    let options = LoadOptions { unit: Some(0.5), ..LoadOptions::default() };
    let scene = load(assets.join("scenes/sponza-dabrovic/sponza.obj"), &options).unwrap();
    assert_eq!(scene.nodes[7].local.matrix().transform_vector3(Vec3::X), Vec3::X * 0.5);
}

#[test]
fn cornell_box_has_its_materials() {
    let Some(assets) = common::assets() else { return };
    let scene = load(assets.join("scenes/cornell-box/CornellBox-Mirror.obj"), &LoadOptions::default()).unwrap();
    let material = |name: &str| scene.materials.iter().find(|material| material.name == name).unwrap();
    assert!(material("tallBox").is_mirror());
    assert_eq!(material("light").emissive, Vec3::new(17.0, 12.0, 4.0));
    let white = material("floor");
    assert_eq!(
        (white.base_color.truncate(), white.metallic, white.roughness),
        (Vec3::new(0.725, 0.71, 0.68), 0.0, 1.0)
    );
}
