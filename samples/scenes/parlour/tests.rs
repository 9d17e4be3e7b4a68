//! What holds for the parlour.

use super::{bounds, cast, load, open_edges, triangles, volume};
use glam::Vec3;
use lucerna::scene::{LightKind, Material, Scene};
use std::collections::BTreeSet;

/// Directions evenly over the sphere.
fn around(count: usize) -> impl Iterator<Item = Vec3> {
    (0..count).map(move |i| {
        let y = 1.0 - (2 * i + 1) as f32 / count as f32;
        let (sin, cos) = (2.4 * i as f32).sin_cos();
        let r = (1.0 - y * y).sqrt();
        Vec3::new(r * cos, y, r * sin)
    })
}

fn place(scene: &Scene, name: &str) -> Vec3 {
    scene.nodes.iter().find(|n| n.name == name && n.mesh.is_none()).unwrap().local.matrix().w_axis.truncate()
}

#[test]
fn the_parlour_is_a_closed_box_seen_from_within() {
    let scene = load("parlour").unwrap();
    let shell = scene.meshes.iter().position(|m| m.name == "shell").unwrap() as u32;
    assert_eq!(open_edges(&scene, shell), 0);
    let inside = volume(&scene, shell);
    assert!((inside + 6.2 * 5.0 * 2.8).abs() < 1e-3, "{inside}");
    // What goes into the walls does not stand out of them far.
    let (low, high) = bounds(&scene);
    assert!((low - Vec3::new(-3.1, 0.0, -2.5)).abs().max_element() < 0.06, "{low}");
    assert!((high - Vec3::new(3.1, 2.8, 2.5)).abs().max_element() < 0.06, "{high}");
    let triangles = triangles(&scene);
    for eye in scene.cameras.iter().map(|c| place(&scene, &c.name)).chain([place(&scene, "lamp"), Vec3::Y * 0.1]) {
        for ray in around(150) {
            let hit = cast(&triangles, eye, ray);
            assert!(hit.is_some_and(|t| t < 8.5), "a ray from {eye} along {ray}: {hit:?}");
        }
    }
    let degenerate = triangles.iter().filter(|([a, b, c], _)| (*b - *a).cross(*c - *a).length() < 1e-12).count();
    assert_eq!(degenerate, 0);
}

#[test]
fn the_lamp_of_the_parlour_is_alone_and_stands_free() {
    let scene = load("parlour").unwrap();
    assert!(scene.environment.is_none() && scene.lights.len() == 1 && scene.lights[0].name == "lamp");
    assert!(matches!(scene.lights[0].kind, LightKind::Point { .. }));
    assert!(scene.materials.iter().all(|m| m.emissive == Vec3::ZERO && !m.unlit), "nothing else shines");
    let triangles = triangles(&scene);
    let lamp = place(&scene, "lamp");
    let nearest = around(600).filter_map(|ray| cast(&triangles, lamp, ray)).fold(f32::INFINITY, f32::min);
    assert!(nearest > 0.5, "{nearest} m");
}

#[test]
fn the_parlour_is_diffuse_and_its_paints_have_names() {
    let scene = load("parlour").unwrap();
    let names: BTreeSet<&str> = scene.materials.iter().map(|m| m.name.as_str()).collect();
    assert_eq!(names.len(), scene.materials.len(), "each name once");
    // Their albedo is the factor of the material alone.
    for name in ["ceiling", "wall", "red wall", "green wall", "sofa", "armchair", "seat", "curtain", "trim"] {
        let paint = scene.materials.iter().find(|m| m.name == name).unwrap_or_else(|| panic!("no {name}"));
        assert!(paint.base_color.truncate().min_element() < 0.9, "{name}");
    }
    for name in ["floor", "rug", "wood", "table top", "mirror"] {
        assert!(names.contains(name), "no {name}");
    }
    let red = |name: &str| {
        let color = scene.materials.iter().find(|m| m.name == name).unwrap().base_color;
        color.x / color.y
    };
    assert!(red("red wall") > 3.0 && red("green wall") < 0.8);
    let (mut all, mut shiny) = (0.0, 0.0);
    for ([a, b, c], primitive) in triangles(&scene) {
        let Material { roughness, metallic, transmission, .. } = scene.materials[primitive.material as usize];
        let area = 0.5 * (b - a).cross(c - a).length();
        all += area;
        if roughness < 0.5 || metallic > 0.0 || transmission > 0.0 {
            shiny += area;
        }
    }
    assert!(shiny < 0.04 * all, "{shiny} of {all} m²");
}
