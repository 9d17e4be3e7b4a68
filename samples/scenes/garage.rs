//! A double garage open to a sunny drive: two cars, racks, a bench with tools. Daylight comes in through the door and
//! has to find its way to the back wall; a work lamp helps at the bench.

use super::kit::{
    Geometry, GradientSky, Model, Opening, Picture, Random, Stage, at, bevel_box, bricks, cuboid, fbm, mottled, placed,
    planks, sheet, slab, srgb, value_noise, wall,
};
use glam::{Mat4, Vec3, vec2, vec3};
use lucerna::scene::{Material, Scene};

mod car;
mod things;

/// Half the inner width (x) and depth (z), and the height.
const HALF: (f32, f32) = (3.6, 3.3);
const HEIGHT: f32 = 2.85;
/// Width and height of the door in the +Z wall.
const DOOR: (f32, f32) = (5.2, 2.25);

/// Materials by number.
struct Palette {
    steel: u32,
    aluminium: u32,
    cardboard: u32,
    colored: u32,
    rubber: u32,
    wood: u32,
    board: u32,
    enamel: u32,
    white: u32,
    tube: u32,
}

pub(super) fn build() -> Scene {
    let mut stage = Stage::new("garage");
    let palette = palette(&mut stage);
    shell(&mut stage, &palette);
    outside(&mut stage);
    contents(&mut stage, &palette);
    let red = car::finish(&mut stage, "red paint", 0xb3241c);
    let hatchback = car::car(&red);
    // The same car in another colour.
    let blue = stage.paint("blue paint", 0x2d5f8f, 0.22);
    let repainted = |part: &(u32, Geometry)| (if part.0 == red.paint { blue } else { part.0 }, part.1.clone());
    let blue = Model { parts: hatchback.parts.iter().map(repainted).collect() };
    stage.mesh_at("red car", hatchback, placed(vec3(-1.35, 0.0, 0.25), 3.0));
    stage.mesh_at("blue car", blue, placed(vec3(1.9, 0.0, 10.6), 172.0));
    lights(&mut stage, &palette);

    stage.camera("drive", [1.9, 1.65, 8.0], [-0.35, 1.0, 0.0], 46.0);
    stage.camera("inside", [3.0, 1.7, -2.75], [-1.1, 0.75, 1.2], 58.0);
    stage.camera("bench", [0.75, 1.6, -0.4], [1.95, 1.1, -3.0], 58.0);
    stage.camera("car", [1.3, 1.15, 3.75], [-1.2, 0.62, 0.7], 42.0);
    stage.camera("racks", [0.75, 1.6, -0.9], [-2.1, 1.0, -3.0], 56.0);
    stage.finish()
}

fn palette(stage: &mut Stage) -> Palette {
    let boards = planks(256, 6, srgb(0xa98556), srgb(0x6f4f2e), 41);
    Palette {
        steel: stage.metal("steel", 0xa3a6a8, 0.45),
        aluminium: stage.metal("ladder aluminium", 0xc2c4c6, 0.35),
        cardboard: stage.textured("cardboard", &mottled(64, 16, srgb(0xb08a5c), srgb(0xa27c50), 0.0, 5), 0.5, 0.95),
        colored: stage.paint("labels and plastic", 0xffffff, 0.4),
        rubber: stage.paint("old rubber", 0x232324, 0.85),
        wood: stage.textured("bench wood", &boards, 1.1, 0.75),
        board: stage.textured("hardboard", &pegboard(), 0.2, 0.8),
        enamel: stage.paint("red enamel", 0xa52c22, 0.35),
        white: stage.paint("door panels", 0xe2e0d9, 0.5),
        tube: stage.material(Material { unlit: true, ..Material::diffuse("lit glass", srgb(0xf4f6ff)) }),
    }
}

/// Brown board with a hole every 2.5 cm.
fn pegboard() -> Picture {
    Picture::new(128, 128, |uv| {
        let p = (uv * 8.0).fract() - vec2(0.5, 0.5);
        let tone = 0.9 + 0.2 * value_noise(uv * 32.0, 32, 6);
        let hole = p.length() < 0.13;
        (if hole { srgb(0x2a1d12) } else { srgb(0x9c7246) * tone }, 0.0)
    })
}

/// Floor, brick walls with a window, ceiling with beams.
fn shell(stage: &mut Stage, palette: &Palette) {
    let (x, z) = HALF;
    let concrete = Picture::new(512, 512, |uv| {
        let grain = fbm(uv * 8.0, 8, 5, 50);
        let fine = value_noise(uv * 128.0, 128, 51);
        // Oil where cars stand.
        let oil = |at: glam::Vec2, size: f32| {
            let d = (uv - at).length() / size + 0.6 * (fbm(uv * 12.0, 12, 3, 52) - 0.5);
            (1.2 - d).clamp(0.0, 1.0)
        };
        let stain = oil(vec2(0.33, 0.42), 0.1).max(oil(vec2(0.29, 0.66), 0.07)).max(0.7 * oil(vec2(0.7, 0.55), 0.12));
        let crack = ((uv.y - 0.5 - 0.015 * (fbm(uv * 6.0, 6, 3, 53) - 0.5)).abs() * 512.0 / 1.5).min(1.0);
        let base = srgb(0xa9a59c).lerp(srgb(0x8d8981), grain) * (0.92 + 0.16 * fine);
        (base.lerp(srgb(0x2f2b27), 0.75 * stain) * (0.55 + 0.45 * crack), 0.0012 * fine + 0.003 * crack)
    });
    let concrete = stage.textured("concrete", &concrete, 2.0 * x, 0.7);
    stage.add("floor", Model::of(concrete, sheet(2.0 * x, 2.0 * z + 0.6, 1, 1).at(0.0, 0.0, 0.3)));
    let blocks = stage.textured("painted blocks", &bricks(256, 4, 8, srgb(0xd6d2c6), srgb(0xb6b2a7), 8), 1.6, 0.9);
    let brick = stage.textured("brick", &bricks(512, 6, 18, srgb(0x9b4a32), srgb(0xb5aea0), 9), 1.4, 0.9);
    stage.add("back wall", Model::of(blocks, wall(2.0 * x + 0.4, HEIGHT + 0.35, 0.2, &[]).at(-x - 0.2, 0.0, -z)));
    stage.add("left wall", Model::of(blocks, wall(2.0 * z, HEIGHT + 0.35, 0.2, &[]).turned_y(90.0).at(-x, 0.0, z)));
    let window = Opening { left: 2.2, bottom: 1.3, width: 1.4, height: 0.8 };
    stage.add(
        "right wall",
        Model::of(blocks, wall(2.0 * z, HEIGHT + 0.35, 0.2, &[window]).turned_y(-90.0).at(x, 0.0, -z)),
    );
    let mut frame = cuboid(0.06, 0.05, 1.4).at(x + 0.1, 1.325, -z + 2.9);
    frame.append(&cuboid(0.06, 0.05, 1.4).at(x + 0.1, 2.075, -z + 2.9));
    for k in -1..=1 {
        frame.append(&cuboid(0.06, 0.7, 0.05).at(x + 0.1, 1.7, -z + 2.9 + 0.67 * k as f32));
    }
    stage.add("window frame", Model::of(palette.white, frame));
    let gate = Opening { left: x + 0.2 - DOOR.0 * 0.5, bottom: 0.0, width: DOOR.0, height: DOOR.1 };
    let front = wall(2.0 * x + 0.4, HEIGHT + 0.35, 0.3, &[gate]).at(-x - 0.2, 0.0, z + 0.3);
    stage.add("front wall", Model::of(brick, front));
    let lintel = stage.paint("lintel", 0xb3ab9a, 0.8);
    stage.add("lintel", Model::of(lintel, bevel_box(DOOR.0 + 0.5, 0.22, 0.34, 0.015).at(0.0, DOOR.1 + 0.11, z + 0.16)));
    let ceiling = stage.textured("ceiling boards", &planks(256, 8, srgb(0xc6b18c), srgb(0xa48a62), 42), 1.2, 0.85);
    stage.add("ceiling", Model::of(ceiling, sheet(2.0 * x, 2.0 * z, 1, 1).turned_x(180.0).at(0.0, HEIGHT, 0.0)));
    stage.add("roof", Model::of(lintel, slab([-x - 0.4, HEIGHT + 0.35, -z - 0.4], [x + 0.4, HEIGHT + 0.5, z + 0.5])));
    let mut beams = Geometry::default();
    for i in 0..4 {
        beams.append(&cuboid(2.0 * x, 0.16, 0.09).at(0.0, HEIGHT - 0.08, -2.4 + 1.6 * i as f32));
    }
    stage.add("beams", Model::of(ceiling, beams));
    stage.mesh_at("door", things::door(palette, DOOR.0, DOOR.1), at(0.0, 0.0, z - 0.02));
}

/// Drive, lawn, hedges and a house wall across.
fn outside(stage: &mut Stage) {
    let z = HALF.1 + 0.6;
    let asphalt = mottled(256, 48, srgb(0x6a6865), srgb(0x4c4a48), 0.003, 61);
    let asphalt = stage.textured("asphalt", &asphalt, 2.0, 0.9);
    stage.add("drive", Model::of(asphalt, sheet(6.4, 14.0, 1, 1).at(0.0, 0.0, z + 7.0)));
    let lawn = mottled(256, 40, srgb(0x6f8f3e), srgb(0x42622a), 0.01, 62);
    let lawn = stage.textured("lawn", &lawn, 2.2, 1.0);
    for (i, side) in [-1.0, 1.0].into_iter().enumerate() {
        let name = ["left lawn", "right lawn"][i];
        stage.add(name, Model::of(lawn, sheet(9.0, 18.0, 1, 1).at(side * 7.7, -0.02, z + 5.0)));
        let kerb = bevel_box(0.1, 0.12, 14.0, 0.015).at(side * 3.25, 0.02, z + 7.0);
        let kerb_paint = stage.paint("kerb", 0xb0aca2, 0.85);
        stage.add(["left kerb", "right kerb"][i], Model::of(kerb_paint, kerb));
    }
    let leaves = mottled(128, 24, srgb(0x5b8038), srgb(0x2c4a1c), 0.02, 63);
    let leaves = stage.textured("hedge", &leaves, 0.7, 0.9);
    stage.add("left hedge", Model::of(leaves, things::hedge(vec3(1.0, 1.3, 9.0), 64).at(-4.4, 0.0, z + 5.2)));
    stage.add("right hedge", Model::of(leaves, things::hedge(vec3(1.0, 1.1, 7.0), 66).at(5.2, 0.0, z + 4.4)));
    let house = stage.textured("cream wall", &mottled(128, 10, srgb(0xe3d6b4), srgb(0xd8c9a4), 0.002, 67), 2.0, 0.95);
    let openings = [2.0, 6.0, 10.0].map(|left| Opening { left, bottom: 1.0, width: 1.4, height: 1.5 });
    let facade = wall(14.0, 5.0, 0.4, &openings).turned_y(180.0).at(7.0, 0.0, z + 14.4);
    stage.add("house", Model::of(house, facade));
    let dark = stage.paint("dark panes", 0x2a3238, 0.1);
    stage.add("panes", Model::of(dark, slab([-6.9, 0.9, z + 14.6], [6.9, 2.6, z + 14.65])));
}

fn contents(stage: &mut Stage, palette: &Palette) {
    let (x, z) = HALF;
    let mut random = Random::new(7);
    for (i, place) in [-2.75, -1.35].into_iter().enumerate() {
        let rack = things::rack(palette, 1.3, &mut random);
        stage.mesh_at(&format!("rack {}", i + 1), rack, at(place, 0.0, -z + 0.26));
    }
    let rack = things::rack(palette, 1.5, &mut random);
    stage.mesh_at("side rack", rack, placed(vec3(-x + 0.26, 0.0, -1.55), 90.0));
    stage.mesh_at("bench", things::bench(palette, 2.3), at(2.1, 0.0, -z + 0.36));
    stage.mesh_at("tool board", things::tool_board(palette, 1.9), at(2.05, 1.15, -z + 0.001));

    let tyre = stage.mesh("tyre", things::tyre(palette));
    for i in 0..4 {
        let shift = [0.0, 0.02, -0.015, 0.01][i];
        stage.place(&format!("tyre {}", i + 1), tyre, at(0.45 + shift, 0.19 * i as f32, -z + 0.42 - shift));
    }
    let leaning = at(3.28, 0.3, 1.4) * Mat4::from_rotation_z(1.35) * Mat4::from_translation(vec3(0.0, -0.095, 0.0));
    stage.place("leaning tyre", tyre, leaning);
    let green = stage.paint("green drum", 0x2f5d4a, 0.45);
    stage.mesh_at("drum", Model::of(green, things::drum()), at(3.15, 0.0, 0.35));
    let orange = stage.paint("orange drum", 0xc4661f, 0.45);
    stage.mesh_at("second drum", Model::of(orange, things::drum()), placed(vec3(3.1, 0.0, -0.35), 40.0));
    stage.mesh_at("ladder", things::ladder(palette, 7), placed(vec3(x - 0.42, 0.0, 2.2), -90.0));
    let mat = stage.textured("workshop mat", &mottled(64, 16, srgb(0x35383b), srgb(0x2a2c2e), 0.001, 70), 0.4, 0.95);
    stage.add("mat", Model::of(mat, bevel_box(1.6, 0.012, 0.7, 0.004).at(2.0, 0.0065, -2.25)));
}

fn lights(stage: &mut Stage, palette: &Palette) {
    let to_sun = vec3(0.42, 0.52, 0.74).normalize();
    stage.sun(to_sun, srgb(0xfff0d6), 4.2);
    let lamp = vec3(1.3, 2.05, -2.55);
    let aim = vec3(1.9, 0.9, -2.95);
    let hood = Mat4::from_translation(lamp) * Mat4::from_rotation_z(0.35) * Mat4::from_rotation_x(0.3);
    stage.mesh_at("work lamp", things::hood(palette), hood);
    stage.spot("work lamp", ((lamp - Vec3::Y * 0.02).to_array(), aim.to_array()), srgb(0xffd9a0), 5.0, (30.0, 62.0));
    let tubes = stage.mesh("tube lamp", things::tube_lamp(palette));
    for (i, z) in [-1.6, 1.1].into_iter().enumerate() {
        stage.place(&format!("tube lamp {}", i + 1), tubes, at(0.2, HEIGHT - 0.1, z));
    }
    stage.spot("tubes", ([0.2, HEIGHT - 0.48, -1.6], [0.2, 0.0, -1.6]), srgb(0xe6f0ff), 13.0, (45.0, 80.0));
    let sky = GradientSky {
        // Darker than by the sun, as in the office: the sky must not flood the room of a technique that lets it in.
        zenith: vec3(0.04, 0.08, 0.16),
        horizon: vec3(0.16, 0.19, 0.22),
        ground: vec3(0.06, 0.06, 0.05),
        to_sun,
        glow: vec3(0.2, 0.17, 0.12),
    };
    stage.scene.environment = Some(sky.environment("summer sky", 256, 128));
}
