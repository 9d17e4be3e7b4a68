//! Odd rooms from the outside: what is said about them, exit codes, and that nothing is left behind.

use std::fs;

use crate::{
    prt::Lab,
    support::{Ran, device},
};
use lucerna::{image, scene::Limits};

/// Settings that make a bake small.
const SMALL: [(&str, u32); 6] =
    [("samples", 500), ("cluster", 125), ("directions", 100), ("rays", 64), ("examples", 60), ("visibility", 12)];

/// An OBJ file of boxes, which is written with its materials.
#[derive(Default)]
struct Obj {
    text: String,
    corners: usize,
}

impl Obj {
    /// A box of a material between two corners, seen from the outside or from within.
    fn cuboid(mut self, material: &str, [low, high]: [[f32; 3]; 2], inside: bool) -> Self {
        self.text += &format!("usemtl {material}\n");
        for i in 0..8 {
            let at = |axis: usize| if i >> axis & 1 == 0 { low[axis] } else { high[axis] };
            self.text += &format!("v {} {} {}\n", at(0), at(1), at(2));
        }
        // Corners of the sides, anticlockwise as seen from the outside.
        for side in [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]] {
            let mut side = side.map(|corner| corner + self.corners + 1);
            if inside {
                side.reverse();
            }
            self.text += &format!("f {} {} {} {}\n", side[0], side[1], side[2], side[3]);
        }
        self.corners += 8;
        self
    }

    fn write(self, lab: &Lab, name: &str, materials: &str) {
        fs::write(lab.at(&format!("{name}.mtl")), materials).unwrap();
        fs::write(lab.at(&format!("{name}.obj")), format!("mtllib {name}.mtl\n{}", self.text)).unwrap();
    }
}

/// A room of 4×3×4 m.
fn room() -> Obj {
    Obj::default().cuboid("wall", [[-2.0, 0.0, -2.0], [2.0, 3.0, 2.0]], true)
}

/// A diffuse material.
fn matt(name: &str, albedo: f32) -> String {
    format!("newmtl {name}\nKd {albedo} {albedo} {albedo}\n")
}

fn bake(lab: &Lab, scene: &str, more: &[&str]) -> Ran {
    let settings: Vec<String> =
        SMALL.iter().flat_map(|(key, value)| ["-D".into(), format!("room.{key}={value}")]).collect();
    let settings: Vec<&str> = settings.iter().map(String::as_str).collect();
    let out = format!("{}.prt", scene.split('.').next().unwrap());
    lab.run(&[&["bake", scene][..], &settings, &["-o", &out], more].concat())
}

fn render(lab: &Lab, scene: &str, more: &[&str]) -> Ran {
    let bake = format!("{}.prt", scene.split('.').next().unwrap());
    lab.run(&[&["render", scene, "--bake", &bake, "--size", "24x18", "--overwrite", "-o", "x.exr"][..], more].concat())
}

/// The sum of a layer of the last picture.
fn sum(lab: &Lab, layer: &str) -> f32 {
    let layers = image::read(lab.at("x.exr"), &Limits::default()).unwrap();
    let data = &layers.layer(layer).unwrap().data;
    assert!(data.iter().all(|value| value.is_finite()), "{layer}");
    data.iter().sum()
}

#[test]
fn scenes_that_are_no_room_are_refused_and_named() {
    if !device() {
        return;
    }
    let lab = Lab::new();
    let empty = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"name":"nothing"}]}"#;
    fs::write(lab.at("empty.gltf"), empty).unwrap();
    fs::write(lab.at("points.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\n").unwrap();
    fs::write(lab.at("lines.obj"), "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\nf 1 1 2\n").unwrap();
    for scene in ["empty.gltf", "points.obj", "lines.obj"] {
        bake(&lab, scene, &[]).expect(3, &[scene, "no surface"]);
    }
    fs::write(lab.at("floor.obj"), "v -1 0 -1\nv -1 0 1\nv 1 0 1\nv 1 0 -1\nf 1 2 3 4\n").unwrap();
    bake(&lab, "floor.obj", &[]).expect(3, &["floor.obj", "--inside"]);
    // A table on a floor in the open, with a lamp beside it.
    let table = Obj::default().cuboid("wall", [[-2.0, -0.1, -2.0], [2.0, 0.0, 2.0]], false);
    table.cuboid("wall", [[0.0, 0.01, 0.0], [1.0, 1.0, 1.0]], false).write(&lab, "table", &matt("wall", 0.5));
    let lamp = ["--light", "1.5,0.5,1.5,3", "--default-light", "never"];
    bake(&lab, "table.obj", &lamp).expect(3, &["table.obj", "the scene is open", "--inside"]);
    for name in ["floor.prt", "floor.prt.parts", "table.prt", "table.prt.parts"] {
        assert!(!lab.at(name).exists(), "{name}");
    }
}

#[test]
fn a_start_in_the_middle_of_the_scene_is_named() {
    if !device() {
        return;
    }
    let lab = Lab::new();
    // A solid body in the open: its camera is outside, and particles from the middle stay inside the body.
    let body = Obj::default().cuboid("wall", [[0.0, 0.0, 0.0], [1.0, 2.0, 1.0]], false);
    body.write(&lab, "body", &matt("wall", 0.5));
    let said = ["particles start in its middle, 0.500,1.000,0.500", "--inside X,Y,Z"];
    bake(&lab, "body.obj", &["--default-light", "never"]).expect(0, &said);
}

#[test]
fn closed_white_rooms_are_refused_when_their_light_has_no_end() {
    if !device() {
        return;
    }
    let lab = Lab::new();
    room().write(&lab, "white", &matt("wall", 1.0));
    bake(&lab, "white.obj", &[]).expect(0, &[]);
    let lamp = ["--light", "0.3,2,0.4,5", "--default-light", "never"];
    // Only colours decide about the sum of all scatterings, so the bake is right for other colours and for one scattering.
    let help = ["white.prt", "there is no end", "smaller albedo", "prt.bounces=false"];
    render(&lab, "white.obj", &lamp).expect(3, &help);
    assert!(!lab.at("x.exr").exists());
    let more = |more: &[&'static str]| [&lamp[..], more].concat();
    render(&lab, "white.obj", &more(&["-D", "prt.bounces=false"])).expect(0, &[]);
    let once = sum(&lab, "indirect");
    render(&lab, "white.obj", &more(&["--set", "wall.albedo=0.5"])).expect(0, &[]);
    assert!(once > 0.0 && sum(&lab, "indirect") > 0.0);
}

#[test]
fn glass_mirrors_and_other_things_left_out_are_named() {
    if !device() {
        return;
    }
    let lab = Lab::new();
    let boxes = room()
        .cuboid("pane", [[-1.5, 0.1, -1.5], [-1.0, 1.0, -1.0]], false)
        .cuboid("chrome", [[0.5, 0.1, 0.5], [1.0, 1.0, 1.0]], false)
        .cuboid("lamp", [[-0.2, 2.8, -0.2], [0.2, 2.9, 0.2]], false);
    let others = "newmtl pane\nKd 0 0 0\nillum 4\nTf 1 1 1\nNi 1.5\nnewmtl chrome\nKd 0.8 0.8 0.8\nPm 1\nPr 0\nnewmtl lamp\nKd 0.5 0.5 0.5\nKe 5 5 5\n";
    boxes.write(&lab, "things", &(matt("wall", 0.5) + others));
    let surfaces = ["glass stops light", "pane", "mirrors reflect light as diffuse surfaces: chrome"];
    bake(&lab, "things.obj", &[]).expect(0, &surfaces);
    let said = render(&lab, "things.obj", &["--light", "0.3,2,0.4,5", "--sun", "30,40", "--env", "area"]);
    let said = said.expect(0, &surfaces);
    for part in
        ["surfaces glow, but they light nothing: lamp", "a sun is off", "the environment is shown, but lights nothing"]
    {
        assert!(said.stderr.contains(part), "{part} is not in {}", said.stderr);
    }
    lab.run(&["check", "things.obj", "--bake", "things.prt", "--lights", "2", "--samples", "8", "--paths", "4"])
        .expect(0, &surfaces);
}

#[test]
fn two_rooms_are_baked_and_a_lamp_lights_its_own() {
    if !device() {
        return;
    }
    let lab = Lab::new();
    let rooms = room().cuboid("wall", [[4.0, 0.0, -2.0], [8.0, 3.0, 2.0]], true);
    rooms.write(&lab, "rooms", &matt("wall", 0.5));
    let lamps = ["0.3,2,0.4,5", "6.3,2,0.4,5"];
    let first = ["--light", lamps[0], "--default-light", "never"];
    bake(&lab, "rooms.obj", &first)
        .expect(0, &["do not reach a room, which is baked, too; a point in it:", "--inside chooses rooms"]);
    let cameras = [0.0, 6.0].map(|x: f32| {
        format!("position = [{:?}, 2.5, 1.8]\ntarget = [{:?}, 1.0, -0.5]\nyfov_degrees = 80.0\n", x + 1.8, x - 0.5)
    });
    let mut found = Vec::new();
    for (number, camera) in cameras.iter().enumerate() {
        let name = format!("camera{number}.toml");
        fs::write(lab.at(&name), camera).unwrap();
        for lamp in lamps {
            render(&lab, "rooms.obj", &["--light", lamp, "--default-light", "never", "--camera", &name]).expect(0, &[]);
            found.push(["direct", "indirect"].map(|layer| sum(&lab, layer)));
        }
    }
    let [[own, other], [back, there]] = [[found[0], found[1]], [found[2], found[3]]];
    for part in 0..2 {
        assert!(own[part] > 0.0 && there[part] > 0.0, "{found:?}");
        assert!(other[part].abs() < 1e-3 * own[part] && back[part].abs() < 1e-3 * there[part], "{found:?}");
    }
    // A room that is not baked has no light.
    fs::remove_file(lab.at("rooms.prt")).unwrap();
    let said = bake(&lab, "rooms.obj", &[&first[..], &["--inside", "0,1,0"]].concat()).expect(0, &[]);
    assert!(!said.stderr.contains("do not reach"), "{}", said.stderr);
}

#[test]
fn impossible_sizes_are_refused_with_numbers_before_work_starts() {
    if !device() {
        return;
    }
    let lab = Lab::new();
    room().write(&lab, "room", &matt("wall", 0.5));
    bake(&lab, "room.obj", &["-D", "room.cluster=1"]).expect(2, &["room.cluster", "8 to 4096"]);
    bake(&lab, "room.obj", &["-D", "room.samples=1000001"]).expect(2, &["room.samples", "16 to 1e6"]);
    // More samples in a cluster than there are: one cluster.
    let told = bake(&lab, "room.obj", &["-D", "room.cluster=4096", "--json"]).expect(0, &[]).json();
    assert_eq!(told["summary"]["clusters"], 1);
    fs::remove_file(lab.at("room.prt")).unwrap();
    let told =
        bake(&lab, "room.obj", &["-D", "room.samples=16", "-D", "room.cluster=8", "--json"]).expect(0, &[]).json();
    assert!(told["summary"]["clusters"].as_u64().unwrap() >= 2, "{told}");
    fs::remove_file(lab.at("room.prt")).unwrap();
    // A million samples with all coefficients between 8085 vectors and all samples.
    let large = [
        ("samples", 1_000_000),
        ("cluster", 4096),
        ("light", 33),
        ("receivers", 0),
        ("directions", 16384),
        ("rays", 65536),
    ];
    let words: Vec<String> =
        large.iter().flat_map(|(key, value)| ["-D".into(), format!("room.{key}={value}")]).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let said = bake(&lab, "room.obj", &words);
    let text = fs::read_to_string("/proc/meminfo").unwrap_or_default();
    let free = text
        .lines()
        .find_map(|line| line.strip_prefix("MemAvailable:")?.split_whitespace().next()?.parse::<u64>().ok());
    if free.is_none_or(|kilobytes| kilobytes > 60 << 20) {
        eprintln!("SKIPPED: the memory of this machine is unknown, or it is enough for a million samples");
        return;
    }
    let said = said.expect(
        2,
        &["room.samples", "1000000 samples need about ", " bytes of memory, ", " are free", "Choose fewer samples"],
    );
    assert!(!said.stderr.contains("samples 0."), "{}", said.stderr);
    assert!(!lab.at("room.prt").exists() && !lab.at("room.prt.parts").exists());
}
