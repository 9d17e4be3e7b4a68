use glam::{Vec3, Vec4};
use lucerna::scene::{Material, Mesh, Node, Pose, Primitive, Scene};
use lucerna_scenes as builtin;

use super::{NamedView, Origin, ViewList, draw, recorded};
use crate::views::draw::{Judge, Refusal};

fn looking(position: [f32; 3], target: [f32; 3]) -> NamedView {
    NamedView {
        name: "v".into(),
        origin: Origin::Random,
        position: position.into(),
        target: target.into(),
        up: Vec3::Y,
        yfov_degrees: 50.0,
        znear: 0.01,
        zfar: None,
    }
}

#[test]
fn views_are_drawn_the_same_and_pass_the_rule_again_from_the_file() {
    for name in ["cornell", "office", "street"] {
        let scene = builtin::load(name).unwrap();
        let pose = Pose::rest(&scene);
        let views = draw::views(&scene, &pose, name, 4, 7).unwrap();
        assert_eq!(views, draw::views(&scene, &pose, name, 4, 7).unwrap(), "{name}");
        assert_ne!(views, draw::views(&scene, &pose, name, 4, 8).unwrap(), "{name}: the seed does nothing");
        let list = ViewList { scene: name.into(), seed: 7, views };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("views.toml");
        std::fs::write(&path, toml::to_string(&list).unwrap()).unwrap();
        let read = ViewList::read(&path).unwrap();
        assert_eq!(read, list, "{name}");
        let judge = Judge::new(&scene, &pose).unwrap();
        for view in &read.views {
            assert_eq!(judge.judge(view), Ok(()), "{name}: {view:?}");
        }
        assert_eq!(read.find("2").unwrap().name, format!("{name}-002"));
        assert_eq!(read.find(&format!("{name}-001")).unwrap(), &read.views[1]);
        assert!(read.find("nowhere").is_err());
    }
}

#[test]
fn walls_sky_backs_and_insides_are_refused() {
    let scene = builtin::load("cornell").unwrap();
    let judge = Judge::new(&scene, &Pose::rest(&scene)).unwrap();
    let camera = &recorded(&scene, &Pose::rest(&scene))[0];
    assert_eq!(judge.judge(camera), Ok(()), "the camera of the box itself");
    // From the same place the other way: nothing there.
    let away = NamedView { target: camera.position * 2.0 - camera.target, ..camera.clone() };
    assert_eq!(judge.judge(&away), Err(Refusal::MostlySky));
    // From behind the back wall, which is single-sided.
    let ahead = (camera.target - camera.position).normalize();
    let behind = NamedView { position: camera.position + ahead * 1.6, target: camera.position, ..camera.clone() };
    assert!(
        matches!(judge.judge(&behind), Err(Refusal::SeenFromBehind | Refusal::InsideGeometry)),
        "{:?}",
        judge.judge(&behind)
    );
    // Above the blocks, a hand from the back wall.
    let close = camera.position + ahead * 1.25 + Vec3::Y * 0.2;
    let wall = NamedView { position: close, target: close + ahead, ..camera.clone() };
    assert_eq!(judge.judge(&wall), Err(Refusal::IntoAWall));
}

/// An axis-parallel box with its fronts outside.
fn solid() -> Scene {
    let positions: Vec<Vec3> =
        (0..8).map(|i| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32) * 2.0 - 1.0).collect();
    let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let indices = quads.iter().flat_map(|q| [q[0], q[1], q[2], q[0], q[2], q[3]]).collect();
    let (normals, tangents) = (vec![Vec3::Y; 8], vec![Vec4::ZERO; 8]);
    let primitive = Primitive { positions, normals, tangents, indices, ..Primitive::default() };
    Scene {
        meshes: vec![Mesh { primitives: vec![primitive], ..Mesh::default() }],
        nodes: vec![Node { mesh: Some(0), ..Node::default() }],
        materials: vec![Material::default()],
        ..Scene::default()
    }
}

#[test]
fn a_solid_body_has_no_views_from_inside() {
    let scene = solid();
    let judge = Judge::new(&scene, &Pose::rest(&scene)).unwrap();
    assert_eq!(judge.judge(&looking([0.0, 0.2, 0.0], [1.0, 0.0, 0.3])), Err(Refusal::InsideGeometry));
    let error = draw::views(&scene, &Pose::rest(&scene), "box", 3, 1).unwrap_err();
    assert!(error.to_string().contains("of 3 views were found"), "{error}");
    assert!(draw::views(&Scene::default(), &Pose::rest(&Scene::default()), "empty", 1, 1).is_err());
}

#[test]
fn lists_with_mistakes_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("v.toml");
    let good =
        "name = 'a'\norigin = 'random'\nposition = [0, 0, 1]\ntarget = [0, 0, 0]\nyfov_degrees = 50\nznear = 0.1\n";
    let list = |views: &str| format!("scene = 'x'\nseed = 1\n{views}");
    std::fs::write(&path, list(&format!("[[view]]\n{good}"))).unwrap();
    ViewList::read(&path).unwrap();
    for (bad, says) in [
        (format!("[[view]]\n{good}[[view]]\n{good}"), "two views"),
        (format!("[[view]]\n{}", good.replace("50", "190")), "yfov_degrees"),
        (format!("[[view]]\n{}", good.replace("znear", "near")), "near"),
    ] {
        std::fs::write(&path, list(&bad)).unwrap();
        let error = ViewList::read(&path).unwrap_err();
        assert_eq!(error.exit_code(), 3);
        assert!(error.to_string().contains(says), "{error}");
    }
}
