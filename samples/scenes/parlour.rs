//! A furnished living room by the light of one lamp in its middle: sofa and armchairs before a fireplace, a dining table,
//! shelves of books. Closed on all sides, and diffuse but for a table top, a mirror and some brass: for techniques that
//! compute in advance how a room passes light on, and then move the lamp. Each kind of surface has a material of its own,
//! by whose name its albedo can be changed. About 79 000 triangles as drawn.

use super::kit::{Model, Random, Stage, at, cup, fern, fruit_bowl, mottled, placed, planks, srgb, tree, veneer};
use glam::{Mat4, Vec3, vec3};
use lucerna::scene::{Material, Scene};

mod cases;
mod pictures;
mod room;
mod seats;
mod tables;
mod things;

/// Half the room's length (x) and depth (z), and its height.
const HALF: (f32, f32) = (3.1, 2.5);
const HEIGHT: f32 = 2.8;
/// The lamp: where it is, and its radiant intensity in W/sr (88 W in all directions).
const LAMP: ([f32; 3], f32) = ([0.0, 1.62, 0.15], 7.0);
/// Where the coffee table and the dining table stand.
const COFFEE: Vec3 = vec3(-1.32, 0.0, 0.25);
const DINING: Vec3 = vec3(1.55, 0.0, 0.6);

/// Materials by number.
struct Palette {
    floor: u32,
    ceiling: u32,
    wall: u32,
    red: u32,
    green: u32,
    trim: u32,
    beam: u32,
    wood: u32,
    oak: u32,
    top: u32,
    sofa: u32,
    armchair: u32,
    pillow: u32,
    seat: u32,
    curtain: u32,
    pane: u32,
    stone: u32,
    brick: u32,
    iron: u32,
    brass: u32,
    gilt: u32,
    shade: u32,
    books: u32,
    paper: u32,
    porcelain: u32,
    glaze: u32,
    fruit: u32,
    clay: u32,
    leaf: u32,
    mirror: u32,
    dial: u32,
}

/// Meshes that stand in several places.
struct Shared {
    cup: u32,
    candlestick: u32,
}

pub(super) fn build() -> Scene {
    let mut stage = Stage::new("parlour");
    let palette = palette(&mut stage);
    room::shell(&mut stage, &palette);
    room::fireplace(&mut stage, &palette);
    room::windows(&mut stage, &palette);
    room::door(&mut stage, &palette);
    let shared = Shared {
        cup: stage.mesh("cup", cup(palette.porcelain, 12)),
        candlestick: stage.mesh("candlestick", things::candlestick(&palette)),
    };
    seating(&mut stage, &palette, &shared);
    dining(&mut stage, &palette, &shared);
    along_the_walls(&mut stage, &palette, &shared);
    stage.mesh_at("pendant", things::pendant(&palette, 0.5), at(LAMP.0[0], HEIGHT - room::BEAM, LAMP.0[2]));
    stage.point("lamp", LAMP.0, srgb(0xfff1e0), LAMP.1);

    stage.camera("sofa", [1.6, 1.7, 0.28], [-2.4, 0.78, 0.2], 52.0);
    stage.camera("table", [0.4, 1.6, -1.75], [1.6, 0.72, 0.75], 54.0);
    stage.camera("corner", [2.7, 1.75, -2.1], [-0.7, 0.72, 0.75], 56.0);
    stage.camera("hearth", [-2.0, 1.2, 1.95], [-0.75, 0.82, -1.4], 50.0);
    stage.finish()
}

fn palette(stage: &mut Stage) -> Palette {
    Palette {
        floor: stage.textured("floor", &planks(512, 12, srgb(0xb98654), srgb(0x8a5c36), 23), 1.8, 0.8),
        ceiling: stage.paint("ceiling", 0xf0eee8, 0.95),
        wall: dyed(stage, "wall", 0xe6dcc6, (12, 1.0), 6),
        red: dyed(stage, "red wall", 0xb9472f, (12, 1.0), 7),
        green: dyed(stage, "green wall", 0x7fa25f, (12, 1.0), 8),
        trim: stage.paint("trim", 0xece8dd, 0.7),
        beam: stage.textured("beam", &veneer(256, srgb(0x7a5233), srgb(0x553620), 9), 1.2, 0.85),
        wood: stage.textured("wood", &veneer(256, srgb(0x8f5c36), srgb(0x5e391f), 31), 1.3, 0.7),
        oak: stage.textured("oak", &veneer(256, srgb(0xcf9f66), srgb(0xa6763f), 32), 0.9, 0.7),
        top: stage.textured("table top", &veneer(256, srgb(0xa3683a), srgb(0x6e4223), 33), 1.1, 0.18),
        sofa: dyed(stage, "sofa", 0xd8c8a6, (40, 0.35), 11),
        armchair: dyed(stage, "armchair", 0x35638f, (40, 0.35), 12),
        pillow: stage.paint("pillow", 0xffffff, 0.95),
        seat: dyed(stage, "seat", 0xa8432f, (40, 0.3), 13),
        curtain: curtain(stage),
        pane: stage.paint("window pane", 0x31435c, 0.7),
        stone: stage.textured("stone", &mottled(128, 8, srgb(0xd9d4c9), srgb(0xb9b2a6), 0.0, 14), 0.8, 0.75),
        brick: room::brick(stage),
        iron: stage.paint("iron", 0x34363a, 0.7),
        brass: stage.metal("brass", 0xd1a85a, 0.4),
        gilt: stage.paint("frame", 0xb98f45, 0.7),
        shade: stage.paint("lamp shade", 0xefe3c6, 0.95),
        books: stage.paint("book cloth", 0xffffff, 0.85),
        paper: stage.paint("paper", 0xeee8d8, 0.95),
        porcelain: stage.paint("porcelain", 0xeeebe4, 0.6),
        // The teapot is a thin shell, seen from both sides.
        glaze: stage.paint_both("glaze", 0x4f7f8c, 0.6),
        fruit: stage.paint("fruit", 0xffffff, 0.7),
        clay: stage.paint("clay", 0xb0623f, 0.85),
        leaf: stage.paint_both("leaves", 0xffffff, 0.8),
        mirror: stage.material(Material {
            metallic: 1.0,
            roughness: 0.0,
            ..Material::diffuse("mirror", srgb(0xe4e6e8))
        }),
        dial: pictures::dial(stage),
    }
}

/// A rough paint or cloth. Its colour is the factor of its material, which a texture with `cells` in `metres` only mottles: so its
/// albedo is one number by which it can be changed. No relief: light computed in advance knows the normals of triangles alone.
fn dyed(stage: &mut Stage, name: &str, hex: u32, (cells, metres): (i32, f32), seed: u32) -> u32 {
    let mottling = mottled(128, cells, Vec3::ONE, Vec3::splat(0.82), 0.0, seed);
    let number = stage.textured(name, &mottling, metres, 0.95);
    stage.scene.materials[number as usize].base_color = srgb(hex).extend(1.0);
    number
}

fn curtain(stage: &mut Stage) -> u32 {
    let cloth = dyed(stage, "curtain", 0xd29a3c, (40, 0.5), 18);
    stage.scene.materials[cloth as usize].double_sided = true;
    cloth
}

/// Sofa and armchairs around the coffee table on its rug.
fn seating(stage: &mut Stage, palette: &Palette, shared: &Shared) {
    let rug = things::rug(stage, palette);
    stage.mesh_at("rug", rug, at(-1.22, 0.0, 0.2));
    let sofa = placed(vec3(-HALF.0 + 0.52, 0.0, 0.25), 90.0);
    stage.mesh_at("sofa", seats::sofa(palette), sofa);
    let pillow = |turn: f32, lean: f32, place: [f32; 3]| {
        sofa * placed(Vec3::from(place), turn) * Mat4::from_rotation_x(lean.to_radians())
    };
    let pillows = [
        (0xa83a2a, 18.0, [-0.72, 0.665, 0.08], -22.0),
        (0x3f6b8c, -8.0, [-0.42, 0.65, 0.13], -26.0),
        (0xd9a23a, -24.0, [0.72, 0.665, 0.07], -22.0),
    ];
    for (i, (hex, turn, place, lean)) in pillows.into_iter().enumerate() {
        stage.mesh_at(&format!("pillow {}", i + 1), seats::scatter(palette, srgb(hex)), pillow(turn, lean, place));
    }
    let armchair = stage.mesh("armchair", seats::armchair(palette));
    stage.place("armchair 1", armchair, placed(vec3(-0.22, 0.0, 1.02), -112.0));
    stage.place("armchair 2", armchair, placed(vec3(-0.36, 0.0, -0.72), -52.0));
    stage.mesh_at("coffee table", tables::coffee_table(palette), Mat4::from_translation(COFFEE));
    let on = |x: f32, z: f32, turn: f32| placed(COFFEE + vec3(x, tables::COFFEE_TOP, z), turn);
    let mut random = Random::new(5);
    stage.mesh_at("teapot", Model::of(palette.glaze, super::teapot::shape(5)), on(0.02, 0.02, 140.0));
    stage.place("cup 1", shared.cup, on(0.13, -0.24, 40.0));
    stage.place("cup 2", shared.cup, on(-0.14, -0.17, 200.0));
    stage.mesh_at("books on the table", things::pile(palette, 3, &mut random), on(-0.02, 0.36, 75.0));
    stage.mesh_at("floor lamp", things::floor_lamp(palette), at(-HALF.0 + 0.42, 0.0, 1.78));
}

/// The dining table with four chairs, laid for tea.
fn dining(stage: &mut Stage, palette: &Palette, shared: &Shared) {
    stage.mesh_at("dining table", tables::dining_table(palette), Mat4::from_translation(DINING));
    let chair = stage.mesh("chair", seats::chair(palette));
    let seats =
        [(-0.56, -0.36, 90.0 + 4.0), (-0.6, 0.37, 90.0 - 7.0), (0.57, -0.37, -90.0 + 5.0), (0.62, 0.36, -90.0 - 9.0)];
    for (i, (x, z, turn)) in seats.into_iter().enumerate() {
        stage.place(&format!("chair {}", i + 1), chair, placed(DINING + vec3(x, 0.0, z), turn));
    }
    let on = |x: f32, z: f32, turn: f32| placed(DINING + vec3(x, tables::DINING_TOP, z), turn);
    stage.mesh_at("fruit bowl", fruit_bowl(palette.porcelain, palette.fruit, 12), on(0.0, 0.08, 0.0));
    stage.place("candlestick 1", shared.candlestick, on(0.03, -0.24, 0.0));
    stage.place("candlestick 2", shared.candlestick, on(-0.06, 0.4, 0.0));
    let plate = stage.mesh("plate", Model::of(palette.porcelain, things::plate()));
    for (i, (side, z)) in [(-1.0, -0.36), (-1.0, 0.36), (1.0, -0.36), (1.0, 0.36)].into_iter().enumerate() {
        let number = i + 1;
        stage.place(&format!("plate {number}"), plate, on(side * 0.28, z, 0.0));
        stage.place(&format!("cup {}", number + 2), shared.cup, on(side * 0.25, z - 0.21, 50.0 * i as f32));
    }
}

/// Bookcase, cabinet, sideboard, clock and plants, and the pictures above.
fn along_the_walls(stage: &mut Stage, palette: &Palette, shared: &Shared) {
    let (x, z) = HALF;
    let mut random = Random::new(71);
    stage.mesh_at("bookcase", cases::bookcase(palette, &mut random), at(1.22, 0.0, -z + 0.2));
    stage.mesh_at("cabinet", cases::sideboard(palette, 1.05, 2), at(-2.44, 0.0, -z + 0.25));
    let on_cabinet = |along: f32, deep: f32| at(-2.44 + along, cases::SIDEBOARD.0, -z + 0.25 + deep);
    stage.mesh_at("table lamp", things::table_lamp(palette), on_cabinet(-0.27, 0.0));
    stage.mesh_at(
        "fern",
        fern((palette.clay, palette.leaf), 9, &mut random),
        on_cabinet(0.28, 0.03) * Mat4::from_scale(Vec3::splat(0.62)),
    );
    let right = placed(vec3(x - 0.25, 0.0, 0.75), -90.0);
    stage.mesh_at("sideboard", cases::sideboard(palette, 1.7, 3), right);
    let on_right = |along: f32, deep: f32, turn: f32| right * placed(vec3(along, cases::SIDEBOARD.0, deep), turn);
    stage.mesh_at("flowers", things::flowers(palette, &mut random), on_right(-0.5, 0.0, 0.0));
    stage.mesh_at("books on the sideboard", things::pile(palette, 4, &mut random), on_right(0.52, 0.02, 80.0));
    stage.mesh_at("jar", Model::of(palette.clay, things::jar()), on_right(0.18, -0.02, 0.0));
    stage.mesh_at("long clock", cases::long_clock(palette), placed(vec3(0.06, 0.0, z - 0.2), 180.0));
    let big = tree((palette.clay, palette.leaf), 57, &mut random);
    stage.mesh_at("plant", big, placed(vec3(x - 0.5, 0.0, z - 0.48), 20.0));
    let mantel = |along: f32| at(room::BREAST.0 + along, room::MANTEL, room::BREAST.2 + 0.1);
    stage.mesh_at("vase 1", Model::of(palette.porcelain, things::vase()), mantel(-0.6));
    stage.mesh_at("mantel clock", things::mantel_clock(palette), mantel(0.42));
    stage.place("candlestick 3", shared.candlestick, mantel(0.66));
    stage.place("candlestick 4", shared.candlestick, mantel(-0.38));
    pictures::hang(stage, palette);
}
