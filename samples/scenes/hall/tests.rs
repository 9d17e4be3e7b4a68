//! What holds for the hall.

use super::{cast, load, open_edges, triangles, volume};
use glam::Vec3;
use lucerna::scene::{LightKind, Node, Scene};

#[test]
fn the_hall_lets_light_in_through_its_windows_only() {
    let scene = load("hall").unwrap();
    let kinds: Vec<_> = scene.lights.iter().map(|light| light.kind).collect();
    let points = kinds.iter().filter(|kind| matches!(kind, LightKind::Point { .. })).count();
    assert_eq!((points, kinds.len()), (5, 6), "lamps and the sun");
    let windows = scene.nodes.iter().filter(|n| n.mesh.is_some() && n.name.contains(" window")).count();
    assert_eq!(windows, 11);
    for mesh in ["south wall", "north wall", "west wall", "east wall", "apse", "roof boards", "slates", "north arcade"]
    {
        let node = scene.nodes.iter().find(|n| n.name == mesh).unwrap();
        assert_eq!(open_edges(&scene, node.mesh.unwrap()), 0, "{mesh} has open edges");
        assert!(volume(&scene, node.mesh.unwrap()) > 1.0, "{mesh} is inside out");
    }
    // What stands between the eye and the sky is all of the hall; what gets out passes a wall at the height of a window.
    let names = ["lawn", "low wall", "tree", "bush", "path"];
    let nodes = scene
        .nodes
        .iter()
        .map(|n| Node { mesh: n.mesh.filter(|_| !names.iter().any(|p| n.name.starts_with(p))), ..n.clone() });
    let hall = Scene { nodes: nodes.collect(), ..scene.clone() };
    let triangles = triangles(&hall);
    let mut out = 0;
    for eye in
        [Vec3::new(-9.6, 0.3, -4.6), Vec3::new(0.1, 7.2, -4.5), Vec3::new(9.7, 0.8, 4.4), Vec3::new(11.9, 1.2, 0.3)]
    {
        for i in 0..150 {
            let y = 1.0 - (i as f32 + 0.5) / 75.0;
            let (sin, cos) = (2.4 * i as f32).sin_cos();
            let r = (1.0 - y * y).sqrt();
            let ray = Vec3::new(r * cos, y, r * sin);
            if cast(&triangles, eye, ray).is_some() {
                continue;
            }
            out += 1;
            // Where it leaves the room through a plane of its walls.
            let to = |wall: f32, at: f32, way: f32| (wall * way.signum() - at) / way;
            let leaves = eye + ray * to(10.0, eye.x, ray.x).min(to(5.0, eye.z, ray.z));
            assert!((1.8..8.6).contains(&leaves.y), "a ray from {eye} gets out at {leaves}");
        }
    }
    assert!((4..200).contains(&out), "{out}");
}
