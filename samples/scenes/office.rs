//! An office for four: desks with their things, shelves of books, sun through venetian blinds and a lamp. About 21 000
//! triangles, two lights.

use super::kit::{
    Geometry, GradientSky, Model, Opening, Picture, Random, Stage, at, bevel_box, carpet, cuboid, cylinder, lettering,
    mottled, placed, sheet, slab, srgb, value_noise, veneer, wall,
};
use glam::{Mat4, Vec2, Vec3, vec2, vec3};
use lucerna::scene::{Material, Scene};

mod furniture;
mod things;

use furniture::DESK;

/// Half the room's width (x) and depth (z), and its height.
const HALF: (f32, f32) = (3.9, 2.9);
const HEIGHT: f32 = 2.75;

/// Materials by number.
struct Palette {
    beech: u32,
    steel: u32,
    grey: u32,
    dark: u32,
    white: u32,
    fabric: u32,
    books: u32,
    clay: u32,
    leaf: u32,
    screen: u32,
    accent: u32,
    bulb: u32,
    blind: u32,
}

pub(super) fn build() -> Scene {
    let mut stage = Stage::new("office");
    let palette = palette(&mut stage);
    shell(&mut stage, &palette);
    desks(&mut stage, &palette);
    along_the_walls(&mut stage, &palette);
    skyline(&mut stage);
    lights(&mut stage, &palette);

    stage.camera("door", [-3.35, 1.62, 2.45], [0.6, 0.75, -0.9], 52.0);
    stage.camera("window", [3.3, 1.7, 2.3], [-1.2, 0.7, -1.1], 54.0);
    stage.camera("desk", [0.35, 1.32, 1.05], [-1.0, 0.78, -0.75], 48.0);
    stage.camera("shelves", [0.6, 1.5, -0.5], [-3.0, 1.0, -2.6], 50.0);
    stage.camera("floor", [-2.6, 0.35, 1.7], [1.6, 0.62, -1.2], 50.0);
    stage.finish()
}

fn palette(stage: &mut Stage) -> Palette {
    let screen = Picture::new(256, 160, |uv| {
        let (line, column) = ((uv.y * 26.0) as u32, uv.x * 46.0);
        let bar = uv.y < 0.06;
        let indent = [0.0, 2.0, 4.0, 4.0, 6.0, 4.0, 2.0][line as usize % 7] + 9.0;
        let length = 6.0 + 24.0 * value_noise(vec2(line as f32 * 7.3, 0.5), 0, 3);
        let ink = column > indent && column < indent + length && (uv.y * 26.0).fract() > 0.45;
        let letter = value_noise(vec2(column * 2.2, line as f32 * 5.0), 0, 8) > 0.32;
        let tone = [srgb(0x9fc3e8), srgb(0xd8d8cf), srgb(0xe0b070)][line as usize % 3];
        let panel = uv.x < 0.16;
        let color = match (bar, panel, ink && letter) {
            (true, ..) => srgb(0x3b4a5f),
            (_, true, _) => srgb(0x26303d),
            (.., true) => tone,
            _ => srgb(0x18202a),
        };
        (color, 0.0)
    });
    let screen = stage.pictured("screen", &screen, vec2(0.536, 0.316), 0.2);
    stage.scene.materials[screen as usize].unlit = true;
    let weave = mottled(128, 32, srgb(0x3f5f78), srgb(0x2d465c), 0.0008, 8);
    Palette {
        beech: stage.textured("beech", &veneer(256, srgb(0xd3ae7e), srgb(0xa87f50), 17), 0.8, 0.5),
        steel: stage.metal("brushed steel", 0xb9bbbd, 0.38),
        grey: stage.paint("grey lacquer", 0xb5b8ba, 0.5),
        dark: stage.paint("black plastic", 0x2a2c2f, 0.45),
        white: stage.paint("white lacquer", 0xe6e4df, 0.4),
        fabric: stage.textured("blue weave", &weave, 0.25, 0.95),
        books: stage.paint("book cloth", 0xffffff, 0.75),
        clay: stage.paint("fired clay", 0xb5623c, 0.85),
        leaf: stage.paint_both("leaves", 0xffffff, 0.55),
        screen,
        accent: stage.material(Material { double_sided: true, ..stage_paint("enamel", 0xd9a62e, 0.35) }),
        bulb: stage.material(Material { unlit: true, ..Material::diffuse("lamp glass", srgb(0xfff3dd)) }),
        blind: stage.paint("blind slats", 0xe9e6de, 0.6),
    }
}

fn stage_paint(name: &str, hex: u32, roughness: f32) -> Material {
    Material { roughness, ..Material::diffuse(name, srgb(hex)) }
}

/// Floor, walls with window and door openings, ceiling.
fn shell(stage: &mut Stage, palette: &Palette) {
    let (x, z) = HALF;
    let pile = stage.textured("carpet", &carpet(256, srgb(0x8f9296), 2), 0.9, 1.0);
    stage.add("floor", Model::of(pile, sheet(2.0 * x, 2.0 * z, 1, 1)));
    let ceiling = stage.paint("ceiling", 0xecebe6, 0.95);
    stage.add("ceiling", Model::of(ceiling, slab([-x - 0.5, HEIGHT, -z - 0.5], [x + 0.5, HEIGHT + 0.3, z + 0.5])));

    let plaster = stage.textured("plaster", &mottled(128, 16, srgb(0xe2ddd2), srgb(0xd8d2c6), 0.0008, 6), 1.0, 0.95);
    let sage = stage.textured("sage plaster", &mottled(128, 16, srgb(0x8da58a), srgb(0x83997f), 0.0008, 7), 1.0, 0.95);
    stage.add("back wall", Model::of(plaster, wall(2.0 * x + 0.6, HEIGHT, 0.15, &[]).at(-x - 0.3, 0.0, -z)));
    stage.add(
        "front wall",
        Model::of(plaster, wall(2.0 * x + 0.6, HEIGHT, 0.15, &[]).turned_y(180.0).at(x + 0.3, 0.0, z)),
    );
    let door = Opening { left: 0.5, bottom: 0.0, width: 0.95, height: 2.08 };
    stage.add("left wall", Model::of(sage, wall(2.0 * z, HEIGHT, 0.15, &[door]).turned_y(90.0).at(-x, 0.0, z)));
    let leaf = bevel_box(0.94, 2.07, 0.045, 0.004).turned_y(90.0).at(-x - 0.06, 1.035, z - 0.975);
    stage.add("door", Model::of(palette.beech, leaf));
    let knob = cylinder(0.022, 0.05, 16).turned_z(-90.0).at(-x - 0.04, 1.02, z - 1.37);
    stage.add("door knob", Model::of(palette.steel, knob));

    let windows = [0.45, 3.05].map(|left| Opening { left, bottom: 0.95, width: 2.3, height: 1.4 });
    stage.add("window wall", Model::of(plaster, wall(2.0 * z, HEIGHT, 0.25, &windows).turned_y(-90.0).at(x, 0.0, -z)));
    let frame = window_frame(palette, 2.3, 1.4);
    let frame = stage.mesh("window frame", frame);
    let blinds = things::blinds(palette, 2.26, 1.36, 8.0);
    let blinds = stage.mesh("blinds", blinds);
    let radiator = things::radiator(palette, 1.6);
    let radiator = stage.mesh("radiator", radiator);
    for (i, opening) in windows.iter().enumerate() {
        let middle = -z + opening.left + 0.5 * opening.width;
        let name = |part: &str| format!("{part} {}", i + 1);
        stage.place(&name("window frame"), frame, placed(vec3(x + 0.17, 1.65, middle), -90.0));
        stage.place(&name("blinds"), blinds, placed(vec3(x + 0.06, 2.35, middle), -90.0));
        stage.place(&name("radiator"), radiator, placed(vec3(x - 0.06, 0.0, middle), -90.0));
        let sill = bevel_box(0.28, 0.03, 2.36, 0.006).at(x + 0.06, 0.955, middle);
        stage.add(&name("window sill"), Model::of(palette.white, sill));
    }
    skirting(stage, palette);
}

fn skirting(stage: &mut Stage, palette: &Palette) {
    let (x, z) = HALF;
    let mut boards = slab([-x, 0.0, -z], [x, 0.08, -z + 0.012]);
    boards.append(&slab([-x, 0.0, z - 0.012], [x, 0.08, z]));
    boards.append(&slab([x - 0.012, 0.0, -z + 0.012], [x, 0.08, z - 0.012]));
    boards.append(&slab([-x, 0.0, -z + 0.012], [-x + 0.012, 0.08, z - 1.48]));
    stage.add("skirting", Model::of(palette.white, boards));
}

/// Bars around and across an opening of `width` × `height`, centred.
fn window_frame(palette: &Palette, width: f32, height: f32) -> Model {
    let mut bars = Geometry::default();
    for x in [-0.5, 0.0, 0.5] {
        bars.append(&cuboid(0.055, height, 0.06).at(x * (width - 0.055), 0.0, 0.0));
    }
    for y in [-0.5, 0.5] {
        bars.append(&cuboid(width - 0.11, 0.055, 0.055).at(0.0, y * (height - 0.055), 0.0));
    }
    Model::of(palette.white, bars)
}

/// Two pairs of desks face to face, each with its things.
fn desks(stage: &mut Stage, palette: &Palette) {
    let desk = stage.mesh("desk", furniture::desk(palette));
    let chair = stage.mesh("chair", furniture::chair(palette));
    let monitor = stage.mesh("monitor", things::monitor(palette));
    let keyboard = stage.mesh("keyboard", things::keyboard(palette));
    let lamp = stage.mesh("desk lamp", things::desk_lamp(palette));
    let mug = stage.mesh("mug", Model::of(palette.accent, things::mug()));
    let paper = stage.paint("paper", 0xf2efe6, 0.9);
    let sheets = stage.mesh("papers", papers(paper));

    // Place of the desk, turn, and turn and shift of its chair.
    let seats = [
        (vec3(-1.15, 0.0, -0.2), 0.0, (18.0, vec3(0.05, 0.0, 0.72))),
        (vec3(-1.15, 0.0, -1.0), 180.0, (-12.0, vec3(-0.08, 0.0, 0.62))),
        (vec3(1.35, 0.0, -0.2), 0.0, (-35.0, vec3(-0.15, 0.0, 0.8))),
        (vec3(1.35, 0.0, -1.0), 180.0, (6.0, vec3(0.0, 0.0, 0.6))),
    ];
    for (i, (place, turn, (swivel, pushed))) in seats.into_iter().enumerate() {
        let here = placed(place, turn);
        let top = here * at(0.0, DESK, 0.0);
        let name = |part: &str| format!("{part} {}", i + 1);
        stage.place(&name("desk"), desk, here);
        stage.place(&name("chair"), chair, here * placed(pushed, swivel));
        let angle = [4.0, -6.0, 8.0, -3.0][i];
        stage.place(&name("monitor"), monitor, top * placed(vec3(-0.05, 0.0, -0.16), angle));
        stage.place(&name("keyboard"), keyboard, top * placed(vec3(-0.08, 0.0, 0.18), angle * 0.5));
        stage.place(&name("papers"), sheets, top * placed(vec3(-0.52, 0.0, 0.1), 12.0 - 9.0 * i as f32));
        if i != 1 {
            stage.place(&name("mug"), mug, top * placed(vec3(0.36, 0.0, 0.02 + 0.05 * i as f32), 40.0 * i as f32));
        }
        if i == 0 || i == 3 {
            stage.place(&name("desk lamp"), lamp, top * placed(vec3(0.6, 0.0, -0.18), -40.0));
        }
    }
}

/// A pile of sheets with two loose ones.
fn papers(paper: u32) -> Model {
    let mut pile = cuboid(0.21, 0.018, 0.297).at(0.0, 0.0092, 0.0);
    pile.append(&cuboid(0.21, 0.001, 0.297).turned_y(14.0).at(0.012, 0.0195, 0.008));
    pile.append(&cuboid(0.21, 0.001, 0.297).turned_y(-24.0).at(0.2, 0.001, 0.05));
    Model::of(paper, pile)
}

fn along_the_walls(stage: &mut Stage, palette: &Palette) {
    let (x, z) = HALF;
    let mut random = Random::new(20);
    for (i, place) in [-3.2, -2.25, -1.3].into_iter().enumerate() {
        let shelf = furniture::shelf(palette, (0.93, 2.05), 6, &mut random);
        let shelf = stage.mesh(&format!("shelf {}", i + 1), shelf);
        stage.place(&format!("shelf {}", i + 1), shelf, at(place, 0.0, -z + 0.17));
    }
    let cabinet = stage.mesh("cabinet", furniture::cabinet(palette));
    for (i, place) in [2.75, 3.25].into_iter().enumerate() {
        stage.place(&format!("cabinet {}", i + 1), cabinet, at(place, 0.0, -z + 0.32));
    }
    let small = furniture::plant(palette, 13, &mut random);
    let small = stage.mesh("small plant", small);
    let size = Mat4::from_scale(Vec3::splat(0.45));
    stage.place("small plant", small, placed(vec3(3.1, 1.3, -z + 0.3), 40.0) * size);
    let plant = furniture::plant(palette, 24, &mut random);
    stage.mesh_at("plant", plant, at(-x + 0.45, 0.0, -1.65));
    stage.mesh_at("basket", things::basket(palette), at(0.15, 0.0, -0.1));
    stage.mesh_at("clock", things::clock(palette), at(0.0, 2.2, -z + 0.001));
    board(stage, palette);
    poster(stage);
}

/// A whiteboard on the back wall with some writing on it.
fn board(stage: &mut Stage, palette: &Palette) {
    let z = -HALF.1;
    let strokes = Picture::new(256, 128, |uv| {
        let p = uv * vec2(20.0, 10.0);
        let curve = |y: f32, width: f32| (p.y - y).abs() < width;
        let axes = (curve(8.5, 0.06) && p.x > 1.5 && p.x < 9.0) || ((p.x - 1.6).abs() < 0.06 && p.y > 2.0 && p.y < 8.5);
        let graph = p.x > 1.6 && p.x < 8.6 && curve(7.8 - 5.0 * (1.0 - (-(p.x - 1.6) * 0.5).exp()), 0.09);
        let line = (2..8).any(|k| {
            let row = k as f32 + 0.5;
            let end = 11.0 + 7.5 * value_noise(vec2(row * 3.7, 1.5), 0, 5);
            p.x > 11.0 && p.x < end && curve(row + 0.12 * (p.x * 9.0).sin() * value_noise(p * 3.0, 0, 6), 0.07)
        });
        let ink = match (axes, graph, line) {
            (true, ..) => srgb(0x33373c),
            (_, true, _) => srgb(0xb8372e),
            (.., true) => srgb(0x2b4f93),
            _ => srgb(0xf1f1ee),
        };
        (ink, 0.0)
    });
    let written = stage.pictured("whiteboard", &strokes, vec2(2.0, 1.0), 0.25);
    let mut face = Geometry::default();
    face.flat_quad([(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0)].map(|(x, y)| vec3(x, y, 0.0161)));
    let mut model = Model::of(written, face);
    let mut frame = slab([-0.02, -0.02, 0.0], [2.02, 0.0, 0.025]);
    frame.append(&slab([-0.02, 1.0, 0.0], [2.02, 1.02, 0.025]));
    frame.append(&slab([-0.02, 0.0, 0.0], [0.0, 1.0, 0.025]));
    frame.append(&slab([2.0, 0.0, 0.0], [2.02, 1.0, 0.025]));
    frame.append(&slab([0.6, -0.03, 0.0], [1.4, -0.02, 0.07]));
    model.add(palette.steel, frame);
    stage.mesh_at("whiteboard", model, at(0.45, 1.0, z + 0.002));
}

/// A framed print on the left wall and a name by the door.
fn poster(stage: &mut Stage) {
    let x = -HALF.0;
    let print = Picture::new(128, 176, |uv| {
        let p = uv - vec2(0.5, 0.42);
        let hills = uv.y > 0.66 + 0.07 * (uv.x * 7.0).sin() + 0.04 * value_noise(uv * 9.0, 0, 4);
        let near = uv.y > 0.8 + 0.06 * (uv.x * 5.0 + 2.0).sin();
        let color = match (near, hills, p.length() < 0.2) {
            (true, ..) => srgb(0x274b52),
            (_, true, _) => srgb(0x5b8a86),
            (.., true) => srgb(0xf0c25a),
            _ => srgb(0xe8765a).lerp(srgb(0xf6dfb8), uv.y * 1.3),
        };
        (color, 0.0)
    });
    let print = stage.pictured("print", &print, vec2(0.6, 0.82), 0.35);
    let mut face = Geometry::default();
    face.flat_quad([(0.0, 0.0), (0.6, 0.0), (0.6, 0.82), (0.0, 0.82)].map(|(x, y)| vec3(x, y, 0.012)));
    let frame = stage.paint("picture frame", 0x3a2c20, 0.4);
    let mut model = Model::of(print, face);
    model.add(frame, bevel_box(0.68, 0.9, 0.02, 0.006).at(0.3, 0.41, 0.001));
    stage.mesh_at("print", model, placed(vec3(x + 0.012, 1.15, -0.1), 90.0));
    let sign =
        stage.pictured("sign", &lettering("EXIT", srgb(0x1f7a4a), srgb(0xf2f5ee), 2), Vec2::new(0.42, 0.19), 0.5);
    let mut face = Geometry::default();
    face.flat_quad([(0.0, 0.0), (0.42, 0.0), (0.42, 0.19), (0.0, 0.19)].map(|(x, y)| vec3(x, y, 0.0)));
    stage.mesh_at("sign", Model::of(sign, face), placed(vec3(x + 0.006, 2.2, HALF.1 - 0.76), 90.0));
}

/// What the windows show: a bright unlit picture of a skyline, low enough to let the sun pass above it.
fn skyline(stage: &mut Stage) {
    let picture = Picture::new(256, 64, |uv| {
        let block = (uv.x * 23.0).floor();
        let roof = 0.42 + 0.34 * value_noise(vec2(block * 5.3, 0.5), 0, 33);
        let pane = ((uv.x * 138.0).fract() > 0.45) && ((uv.y * 32.0).fract() > 0.5);
        let wall = srgb(0xc7c9c8).lerp(srgb(0x9aa3ab), value_noise(vec2(block * 2.1, 3.5), 0, 34));
        let sky = srgb(0xe6eef6).lerp(srgb(0xc3d8ee), 1.0 - uv.y);
        let color = match (uv.y > roof, pane) {
            (true, true) => wall * 0.72,
            (true, false) => wall,
            _ => sky,
        };
        (color, 0.0)
    });
    let view = stage.pictured("skyline", &picture, vec2(36.0, 8.0), 1.0);
    stage.scene.materials[view as usize].unlit = true;
    let x = HALF.0 + 9.0;
    let mut pane = Geometry::default();
    pane.flat_quad([(-18.0, -3.0), (18.0, -3.0), (18.0, 5.0), (-18.0, 5.0)].map(|(z, y)| vec3(x, y, z)));
    stage.add("skyline", Model::of(view, pane));
}

/// The sun through the blinds and a lamp over the desks.
fn lights(stage: &mut Stage, palette: &Palette) {
    let to_sun = vec3(0.8, 0.52, 0.3).normalize();
    stage.sun(to_sun, srgb(0xfff0d4), 14.0);
    let lamp = vec3(0.1, HEIGHT, -0.6);
    stage.mesh_at("pendant", things::pendant(palette, 0.5), Mat4::from_translation(lamp));
    let below = [lamp.x, HEIGHT - 0.5 - 0.09, lamp.z];
    stage.spot("pendant", (below, [lamp.x, 0.0, lamp.z]), srgb(0xffe8c8), 13.0, (40.0, 80.0));
    let sky = GradientSky {
        // Much darker than by the sun: techniques that take the sky for unshadowed ambient light would flood the room.
        zenith: Vec3::new(0.03, 0.05, 0.085),
        horizon: Vec3::new(0.1, 0.115, 0.13),
        ground: Vec3::new(0.05, 0.048, 0.04),
        to_sun,
        glow: Vec3::new(0.1, 0.085, 0.06),
    };
    stage.scene.environment = Some(sky.environment("morning sky", 128, 64));
}
