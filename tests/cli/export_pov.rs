//! The POV-Ray export: rendered by `povray` and held beside our own path tracer, in linear light.

use crate::support;
use crate::support::lucerna;
use glam::{Mat4, Vec3, Vec4};
use lucerna::{
    reference::path,
    scene::{
        Camera, Environment, Light, LightKind, Material, Mesh, Node, Pose, Primitive, Projection, Scene, Transform,
        View, bvh::Bvh,
    },
};
use lucerna_samples::{
    args::Size,
    export_pov::{self, Export, Pov, povray},
};
use lucerna_scenes as builtin;

/// Whether POV-Ray is there. Under CI it must be.
fn povray_is_there() -> bool {
    let found = povray::find();
    assert!(found.is_ok() || std::env::var_os("CI").is_none(), "{}", found.unwrap_err());
    if let Err(error) = &found {
        eprintln!("SKIPPED: {error}");
    }
    found.is_ok()
}

/// A disk that is full after some of the side files leaves none of them; one that was there before is what it was.
#[cfg(target_os = "linux")]
#[test]
fn a_disk_that_fills_up_keeps_no_part_of_an_export() {
    let folder = tempfile::tempdir().unwrap();
    let script = "mount -t tmpfs -o size=$LUCERNA_TEST_ROOM tmpfs \"$0\" || exit 99; echo old > \"$0/mine.txt\"; \"$@\"; code=$?; ls \"$0\"; exit $code";
    let root = support::command("id").arg("-u").output().is_ok_and(|id| id.stdout == b"0\n");
    let scene = folder.path().join("scene.pov");
    for (room, code) in [("16m", 0), ("256k", 1)] {
        let mut limited = support::command("unshare");
        limited.args(if root { &["-m"][..] } else { &["-Urm"] }).args(["sh", "-c", script]).arg(folder.path());
        limited.env("LUCERNA_TEST_ROOM", room).arg(env!("CARGO_BIN_EXE_lucerna"));
        limited.args(["export-pov", "--builtin", "office", "-q", "-o"]).arg(&scene);
        let Ok(output) = limited.output() else {
            eprintln!("SKIPPED: there is no unshare");
            return;
        };
        let said = String::from_utf8_lossy(&output.stderr);
        if output.status.code() == Some(99) || said.contains("unshare") {
            eprintln!("SKIPPED: no file system can be mounted here: {said}");
            return;
        }
        assert_eq!(output.status.code(), Some(code), "{said}");
        let left = String::from_utf8_lossy(&output.stdout).into_owned();
        if code == 0 {
            // The test must be able to fail: there are side files.
            assert!(left.contains("scene.pov") && left.lines().count() > 3, "{left}");
        } else {
            assert!(said.contains("No space left"), "{said}");
            assert_eq!(left, "mine.txt\n", "something was left behind");
        }
    }
}

const SIZE: Size = Size { width: 48, height: 36 };

fn direct_only() -> Pov {
    Pov { radiosity: false, ..Pov::default() }
}

fn view_of(scene: &Scene) -> View {
    View::of_camera(scene, &Pose::rest(scene), 0, [SIZE.width, SIZE.height]).unwrap()
}

fn exported(scene: &Scene, settings: &Pov) -> Export {
    export_pov::export(scene, &Pose::rest(scene), &view_of(scene), settings, "test").unwrap()
}

/// The linear picture of POV-Ray.
fn by_povray(scene: &Scene, settings: &Pov) -> Vec<Vec3> {
    let options = povray::Options { time_limit: std::time::Duration::from_secs(120), ..Default::default() };
    let rendered = povray::render(&exported(scene, settings), SIZE, &options).unwrap();
    let picture = rendered.picture;
    assert_eq!((picture.width, picture.height), (SIZE.width, SIZE.height));
    let main = picture.main().unwrap();
    let at = ["R", "G", "B"].map(|c| main.channel(c).unwrap());
    main.data.chunks(main.channels.len()).map(|p| Vec3::from_array(at.map(|i| p[i]))).collect()
}

/// Ours: matt surfaces only.
fn by_rays(scene: &Scene, samples: u32, bounces: u32, sources: path::Sources) -> path::Layers {
    let pose = Pose::rest(scene);
    let settings = path::Settings { samples, bounces, diffuse_only: true, sources, ..Default::default() };
    path::trace(scene, &pose, &Bvh::build(scene, &pose), &view_of(scene), &settings)
}

fn mean(pixels: &[Vec3]) -> Vec3 {
    pixels.iter().sum::<Vec3>() / pixels.len() as f32
}

/// Share of pixels whose largest channel error is above `tolerance` of the larger value.
fn off(a: &[Vec3], b: &[Vec3], tolerance: f32) -> f32 {
    let wrong = |(a, b): &(&Vec3, &Vec3)| {
        let larger = a.max_element().max(b.max_element()).max(1e-4);
        (**a - **b).abs().max_element() > tolerance * larger
    };
    a.iter().zip(b).filter(wrong).count() as f32 / a.len() as f32
}

/// A square of half-width `s` facing up.
fn ground(s: f32) -> Primitive {
    Primitive {
        positions: [(-s, s), (s, s), (s, -s), (-s, -s)].map(|(x, z)| Vec3::new(x, 0.0, z)).to_vec(),
        normals: vec![Vec3::Y; 4],
        tangents: vec![Vec4::ZERO; 4],
        indices: vec![0, 1, 2, 0, 2, 3],
        ..Primitive::default()
    }
}

/// The ground seen from an odd place.
fn plain(albedo: Vec3) -> Scene {
    let projection = Projection::Perspective { yfov: 0.9, aspect: None, znear: 0.01, zfar: Some(100.0) };
    let turned = Mat4::from_rotation_y(0.55) * Mat4::from_rotation_x(-0.95) * Mat4::from_rotation_z(0.1);
    let eye = Mat4::from_translation(Vec3::new(1.5, 3.0, 2.0)) * turned;
    Scene {
        nodes: vec![
            Node { mesh: Some(0), ..Node::default() },
            Node { camera: Some(0), local: Transform::Matrix(eye), ..Node::default() },
        ],
        meshes: vec![Mesh { primitives: vec![ground(20.0)], ..Mesh::default() }],
        materials: vec![Material::diffuse("grey", albedo)],
        cameras: vec![Camera { name: String::new(), projection }],
        ..Scene::default()
    }
}

fn lit(mut scene: Scene, kind: LightKind, intensity: f32, place: Mat4) -> Scene {
    let color = Vec3::new(1.0, 0.5, 0.25);
    scene.lights.push(Light { name: "lamp \"1\"\n".into(), kind, color, intensity });
    let light = Some(scene.lights.len() as u32 - 1);
    scene.nodes.push(Node { light, local: Transform::Matrix(place), ..Node::default() });
    scene
}

#[test]
fn lights_of_every_kind_give_the_same_light() {
    if !povray_is_there() {
        return;
    }
    let place = Mat4::from_translation(Vec3::new(0.4, 1.2, 0.1));
    let down = Mat4::from_rotation_x(-1.2);
    for (name, kind, intensity) in [
        ("point", LightKind::Point { range: None }, 3.0),
        ("spot", LightKind::Spot { range: None, inner: 0.3, outer: 0.8 }, 3.0),
        ("sun", LightKind::Directional, 2.0),
    ] {
        let mut scene = lit(plain(Vec3::new(0.8, 0.5, 0.3)), kind, intensity, place * down);
        // A cube casts a shadow, so that places are compared, too; mirrored by its transform, which changes nothing of it.
        scene.meshes.push(Mesh { primitives: vec![ground(0.3)], ..Mesh::default() });
        scene.materials[0].double_sided = true;
        let local = Transform::Matrix(
            Mat4::from_translation(Vec3::new(0.1, 0.3, 0.0)) * Mat4::from_scale(Vec3::new(-1.0, 1.0, 1.0)),
        );
        scene.nodes.push(Node { mesh: Some(1), local, ..Node::default() });
        let (theirs, ours) = (by_povray(&scene, &direct_only()), by_rays(&scene, 1, 0, path::Sources::PUNCTUAL).direct);
        let (ratio, wrong) = (mean(&theirs) / mean(&ours), off(&theirs, &ours, 5e-3));
        println!("{name}: ratio {ratio}, {:.2} % of pixels differ by more than 0.5 %", 100.0 * wrong);
        assert!((ratio - 1.0).abs().max_element() < 4e-3 && wrong < 0.01, "{name}");
    }
}

/// Listing 9: lights without shadows; and the ambient light of POV-Ray 3.6.
#[test]
fn shadows_and_ambient_light_are_settings() {
    let spot = LightKind::Spot { range: None, inner: 0.3, outer: 0.8 };
    let mut scene = plain(Vec3::new(0.8, 0.5, 0.3));
    for kind in [LightKind::Point { range: None }, spot, LightKind::Directional] {
        scene = lit(scene, kind, 1.0, Mat4::from_translation(Vec3::Y));
    }
    let shadowless = |pov: &Pov| exported(&scene, pov).text.matches(" shadowless").count();
    assert_eq!(
        (shadowless(&direct_only()), shadowless(&Pov { shadows: false, ..direct_only() })),
        (0, 2),
        "the cone of a spot light is a shadow"
    );
    let notes = exported(&scene, &Pov { shadows: false, ..direct_only() }).notes.join("\n");
    assert!(notes.contains("its cone is made by a shadow"), "{notes}");
    let error = Pov { ambient: -1.0, ..Pov::default() };
    let scene = plain(Vec3::new(0.8, 0.5, 0.3));
    let refused = export_pov::export(&scene, &Pose::rest(&scene), &view_of(&scene), &error, "test").unwrap_err();
    assert!(refused.to_string().contains("pov.ambient"), "{refused}");
    if !povray_is_there() {
        return;
    }
    let dark = by_povray(&scene, &direct_only());
    assert!(dark.iter().all(|pixel| *pixel == Vec3::ZERO));
    let shown = by_povray(&scene, &Pov { ambient: 0.1, ..direct_only() });
    let ground = shown[SIZE.width as usize * SIZE.height as usize / 2 + SIZE.width as usize / 2];
    assert!((ground - Vec3::new(0.08, 0.05, 0.03)).abs().max_element() < 1e-3, "{ground}");
}

#[test]
fn the_cornell_box_has_our_direct_light() {
    if !povray_is_there() {
        return;
    }
    let scene = builtin::load("cornell").unwrap();
    let theirs = by_povray(&scene, &direct_only());
    let ours = by_rays(&scene, 1, 0, path::Sources::ALL);
    let shown: Vec<Vec3> = ours.direct.iter().zip(&ours.emission).map(|(d, e)| *d + *e).collect();
    let (ratio, wrong) = (mean(&theirs) / mean(&shown), off(&theirs, &shown, 5e-3));
    println!("ratio {ratio}, {:.2} % of pixels differ by more than 0.5 %", 100.0 * wrong);
    assert!((ratio - 1.0).abs().max_element() < 5e-3 && wrong < 0.01);
}

#[test]
fn the_cornell_box_has_our_bounces_where_brightness_is_one() {
    if !povray_is_there() {
        return;
    }
    let scene = builtin::load("cornell").unwrap();
    let direct = mean(&by_povray(&scene, &direct_only()));
    let table_1 = |brightness, recursion_limit| {
        let settings = Pov { brightness, recursion_limit, ..Pov::default() };
        (mean(&by_povray(&scene, &settings)) - direct).element_sum()
    };
    let ours = |bounces| mean(&by_rays(&scene, 64, bounces, path::Sources::PUNCTUAL).indirect).element_sum();
    let (one, two) = (ours(1), ours(2));
    let (pov_one, pov_two) = (table_1(1.0, 1), table_1(1.0, 2));
    println!("brightness 1: one bounce {:.3} of ours, two bounces {:.3}", pov_one / one, pov_two / two);
    println!("our second bounce adds {:.3} of the first", two / one - 1.0);
    let paper = table_1(2.4, 2);
    println!("table 1 (2.4, limit 2): {:.3} of our one bounce, {:.3} of two", paper / one, paper / two);
    assert!((pov_one / one - 1.0).abs() < 0.15, "one bounce");
    assert!((pov_two / two - 1.0).abs() < 0.15, "two bounces");
    assert!(paper > 2.0 * two);
}

#[test]
fn the_sky_is_the_same_way_round() {
    if !povray_is_there() {
        return;
    }
    // Bright in one direction that no symmetry keeps, seen around it.
    let (width, height) = (32u32, 16u32);
    let pixels = (0..width * height)
        .map(|i| {
            let (x, y) = ((i % width) as f32 / width as f32, (i / width) as f32 / height as f32);
            Vec3::new(0.2 + x, 0.2 + y, 0.5 + 0.5 * (x * 6.3).sin())
        })
        .collect();
    let environment = Environment { name: String::new(), width, height, pixels, rotation: 0.7, scale: 1.5 };
    for (yaw, pitch) in [(0.0f32, 0.5f32), (1.9, 0.6), (4.0, 0.9)] {
        let mut scene = plain(Vec3::ONE);
        let eye = Mat4::from_translation(Vec3::Y) * Mat4::from_rotation_y(yaw) * Mat4::from_rotation_x(pitch);
        scene.nodes[1].local = Transform::Matrix(eye);
        scene.environment = Some(environment.clone());
        let (theirs, ours) = (by_povray(&scene, &direct_only()), by_rays(&scene, 1, 0, path::Sources::ALL).emission);
        let seen: Vec<usize> = (0..ours.len()).filter(|&i| ours[i] != Vec3::ZERO).collect();
        let error: f32 =
            seen.iter().map(|&i| (theirs[i] - ours[i]).abs().max_element()).sum::<f32>() / seen.len() as f32;
        println!("yaw {yaw}: {} pixels, mean error {error}", seen.len());
        assert!(seen.len() > 1000 && error < 0.04);
    }
}

#[test]
fn emissive_surfaces_light_as_lamps() {
    if !povray_is_there() {
        return;
    }
    // A square of 0.4 m, 1 m above the ground, facing down.
    let mut scene = plain(Vec3::splat(0.5));
    scene.meshes.push(Mesh { primitives: vec![Primitive { material: 1, ..ground(0.2) }], ..Mesh::default() });
    scene.materials.push(Material::emitter("panel", Vec3::new(9.0, 6.0, 3.0)));
    let local = Transform::Matrix(Mat4::from_translation(Vec3::Y) * Mat4::from_rotation_x(std::f32::consts::PI));
    scene.nodes.push(Node { mesh: Some(1), local, ..Node::default() });
    let theirs = by_povray(&scene, &direct_only());
    let ours = by_rays(&scene, 400, 0, path::Sources::EMISSIVE);
    let on_ground = |pixels: &[Vec3]| {
        let chosen: Vec<Vec3> =
            (0..pixels.len()).filter(|&i| ours.emission[i] == Vec3::ZERO).map(|i| pixels[i]).collect();
        mean(&chosen)
    };
    let ratio = on_ground(&theirs) / on_ground(&ours.direct);
    println!("ratio {ratio}");
    assert!((ratio - 1.0).abs().max_element() < 0.03);
}

#[test]
fn the_command_writes_renders_and_explains() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    let (pov, exr) = (file("box.pov"), file("box.exr"));
    let base = ["export-pov", "--builtin", "cornell", "--size", "32x24", "-o", &pov];
    lucerna(base.iter().chain(&["-D", "pov.brightness=1.5", "-D", "count=10"])).expect(0, &[]);
    let text = std::fs::read_to_string(&pov).unwrap();
    for part in ["#version 3.7", "assumed_gamma 1", "brightness 1.5", "count 10\n", "error_bound 0.25", "mesh2"] {
        assert!(text.contains(part), "{part}");
    }
    lucerna(base).expect(1, &["box.pov"]);
    lucerna(base.iter().chain(&["--overwrite", "-D", "pov.count=0"])).expect(2, &["count"]);
    lucerna(["export-pov", "--builtin", "cornell", "-o", &file("box.txt")]).expect(2, &[".pov"]);
    let printed = lucerna(["export-pov", "--print-config"]).expect(0, &[]);
    assert!(printed.stdout.contains("brightness = 2.4"), "{}", printed.stdout);
    let nothing = support::ran(
        support::command(env!("CARGO_BIN_EXE_lucerna"))
            .args(base)
            .args(["--overwrite", "--render", &exr])
            .env("PATH", ""),
    );
    nothing.expect(2, &["povray", "Install"]);
    if povray_is_there() {
        lucerna(base.iter().chain(&["--overwrite", "--render", &exr])).expect(0, &[]);
        assert!(std::path::Path::new(&exr).is_file());
        let broken = Export { text: "#version 3.7;\nsphere { 0 ".into(), ..Export::default() };
        let error = povray::render(&broken, SIZE, &povray::Options::default()).unwrap_err();
        assert!(error.to_string().contains("Parse Error"), "{error}");
        let slow = povray::Options { time_limit: std::time::Duration::from_millis(1), ..Default::default() };
        let scene = builtin::load("cornell").unwrap();
        let error = povray::render(&exported(&scene, &Pov::default()), SIZE, &slow).unwrap_err();
        assert!(error.to_string().contains("stopped after"), "{error}");
    }
}
