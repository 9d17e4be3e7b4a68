//! A conference room for eighteen: a long table with an inlay of polished stone, chairs on chrome, four lamps, a mirror, glass. About
//! 190 000 triangles as drawn, most of them in the chairs, which are instances of one. Nothing leads out of it.

use super::kit::{
    Geometry, Model, Picture, Random, Stage, at, bevel_box, carpet, cup, fern, fruit_bowl, lettering, mottled, placed,
    slab, srgb, terrain, tree, value_noise, veneer,
};
use glam::{Mat4, Vec2, Vec3, vec2, vec3};
use lucerna::scene::{Material, Scene};

mod furniture;
mod things;

use furniture::TABLE;

/// Half the room's length (x) and width (z), and its height.
const HALF: (f32, f32) = (5.0, 3.2);
const HEIGHT: f32 = 2.85;

/// Radiant intensity of a lamp, W/sr.
const LAMP: f32 = 6.5;

/// Materials by number.
struct Palette {
    walnut: u32,
    stone: u32,
    leather: u32,
    piping: u32,
    chrome: u32,
    brass: u32,
    glass: u32,
    white: u32,
    dark: u32,
    porcelain: u32,
    paper: u32,
    cover: u32,
    fruit: u32,
    clay: u32,
    leaf: u32,
    bulb: u32,
}

pub(super) fn build() -> Scene {
    let mut stage = Stage::new("conference");
    let palette = palette(&mut stage);
    shell(&mut stage, &palette);
    seats(&mut stage, &palette);
    on_the_table(&mut stage, &palette);
    along_the_walls(&mut stage, &palette);
    boards(&mut stage, &palette);
    lamps(&mut stage, &palette);

    stage.camera("door", [-4.6, 1.75, 2.35], [0.9, 0.72, -0.75], 50.0);
    stage.camera("head", [4.3, 1.5, 0.62], [-1.2, 0.85, -0.3], 52.0);
    stage.camera("mirror", [-2.35, 1.62, 2.3], [0.25, 1.08, -2.6], 52.0);
    stage.camera("table", [1.0, 1.36, 1.15], [-0.55, 0.78, -0.2], 44.0);
    stage.finish()
}

fn palette(stage: &mut Stage) -> Palette {
    let metal = |name: &str, hex: u32, roughness: f32| Material {
        metallic: 1.0,
        roughness,
        ..Material::diffuse(name, srgb(hex))
    };
    Palette {
        walnut: stage.textured("walnut", &veneer(256, srgb(0x9a6b43), srgb(0x5f3d25), 31), 1.1, 0.4),
        // Reflects as a polished dielectric does, and has no colour of its own.
        stone: stage.material(metal("polished stone", 0x46484b, 0.0)),
        leather: stage.textured("leather", &mottled(128, 48, srgb(0x42606b), srgb(0x36505a), 0.0004, 13), 0.4, 0.55),
        piping: stage.paint("piping", 0xb8b0a0, 0.6),
        chrome: stage.material(metal("chrome", 0xe4e6e8, 0.0)),
        brass: stage.metal("brass", 0xd1a85a, 0.35),
        glass: stage.material(Material {
            transmission: 1.0,
            roughness: 0.0,
            ..Material::diffuse("glass", vec3(0.97, 0.99, 0.98))
        }),
        white: stage.paint("white lacquer", 0xe9e7e2, 0.4),
        dark: stage.paint("black plastic", 0x26282b, 0.45),
        porcelain: stage.paint("porcelain", 0xf0eee8, 0.25),
        paper: stage.paint("paper", 0xf1efe7, 0.95),
        cover: stage.paint("book cloth", 0xffffff, 0.8),
        fruit: stage.paint("fruit", 0xffffff, 0.45),
        clay: stage.paint("glazed clay", 0x4a6f78, 0.35),
        leaf: stage.paint_both("leaves", 0xffffff, 0.5),
        bulb: stage.material(Material { unlit: true, ..Material::diffuse("lamp glass", srgb(0xfff4e0)) }),
    }
}

/// Floor, ceiling and four walls, each with what covers it.
fn shell(stage: &mut Stage, palette: &Palette) {
    let (x, z) = HALF;
    let out = 0.2;
    let pile = stage.textured("carpet", &carpet(256, srgb(0x7d8b95), 5), 0.9, 1.0);
    stage.add("floor", Model::of(pile, slab([-x - out, -0.2, -z - out], [x + out, 0.0, z + out])));
    let ceiling = stage.paint("ceiling", 0xeeece6, 0.95);
    let mut above = slab([-x - out, HEIGHT, -z - out], [x + out, HEIGHT + 0.2, z + out]);
    // Acoustic tiles, each hung a little below it.
    let (columns, rows) = (8, 5);
    let (wide, deep) = (2.0 * x / columns as f32, 2.0 * z / rows as f32);
    for i in 0..columns * rows {
        let at = [i % columns, i / columns].map(|k| k as f32 + 0.5);
        let tile = bevel_box(wide - 0.05, 0.035, deep - 0.05, 0.012);
        above.append(&tile.at(at[0] * wide - x, HEIGHT - 0.03, at[1] * deep - z));
    }
    stage.add("ceiling", Model::of(ceiling, above));
    let plaster = stage.textured("plaster", &mottled(128, 16, srgb(0xe6e0d4), srgb(0xdcd5c8), 0.0006, 6), 1.0, 0.95);
    let mut walls = slab([-x - out, 0.0, -z - out], [x + out, HEIGHT, -z]);
    walls.append(&slab([-x - out, 0.0, z], [x + out, HEIGHT, z + out]));
    walls.append(&slab([-x - out, 0.0, -z], [-x, HEIGHT, z]));
    walls.append(&slab([x, 0.0, -z], [x + out, HEIGHT, z]));
    stage.add("walls", Model::of(plaster, walls));

    // Slats of wood on the long wall with the mirror.
    let mut slats = Geometry::default();
    let count = 76;
    let pitch = 2.0 * x / count as f32;
    for i in 0..count {
        let slat = bevel_box(HEIGHT - 0.13, pitch - 0.05, 0.032, 0.008).turned_z(90.0);
        slats.append(&slat.at((i as f32 + 0.5) * pitch - x, HEIGHT * 0.5 + 0.03, -z + 0.016));
    }
    stage.add("slats", Model::of(palette.walnut, slats));
    let cloth = cloth(stage);
    stage.add("curtains", curtains(cloth));
    let mut boards = slab([-x, 0.0, -z], [x, 0.09, -z + 0.034]);
    boards.append(&slab([-x, 0.0, -z + 0.034], [-x + 0.014, 0.09, z]));
    boards.append(&slab([x - 0.014, 0.0, -z + 0.034], [x, 0.09, z]));
    stage.add("skirting", Model::of(palette.white, boards));
    let mut leaf = bevel_box(0.05, 2.1, 0.98, 0.006).at(-x + 0.02, 1.05, 1.9);
    for side in [-0.56, 0.56] {
        leaf.append(&bevel_box(0.08, 2.16, 0.1, 0.006).at(-x + 0.03, 1.08, 1.9 + side));
    }
    leaf.append(&bevel_box(0.08, 0.1, 1.22, 0.006).at(-x + 0.03, 2.19, 1.9));
    let mut model = Model::of(palette.walnut, leaf);
    model.add(palette.chrome, things::handle().turned_y(90.0).at(-x + 0.045, 1.03, 1.52));
    stage.add("door", model);
}

fn cloth(stage: &mut Stage) -> u32 {
    let weave = mottled(128, 40, srgb(0xb5482f), srgb(0x9c3a26), 0.0006, 18);
    let cloth = stage.textured("curtain", &weave, 0.5, 0.95);
    stage.scene.materials[cloth as usize].double_sided = true;
    cloth
}

/// Two drawn curtains in folds along the other long wall, facing the room.
fn curtains(cloth: u32) -> Model {
    let (x, z) = HALF;
    let height = HEIGHT - 0.12;
    let mut both = Geometry::default();
    for (from, to, seed) in [(-x + 0.35, -0.01, 3u32), (0.01, x - 0.35, 4)] {
        let folds = |p: Vec2| {
            let drift = 1.6 * value_noise(vec2(p.x * 1.7, 0.3), 0, seed);
            // Fuller at the hem (y of the sheet becomes height).
            let depth = 0.035 + 0.025 * (0.5 - p.y / height);
            depth * (p.x * 33.0 + drift).sin() + 0.012 * value_noise(p * vec2(6.0, 0.8), 0, seed ^ 9)
        };
        let half = 0.5 * height;
        let sheet = terrain(vec2(from, -half), vec2(to, half), 250, 6, folds);
        // What faced up faces into the room.
        both.append(&sheet.turned_x(-90.0).at(0.0, half + 0.03, z - 0.12));
    }
    let rail = bevel_box(2.0 * x - 0.4, 0.06, 0.14, 0.01).at(0.0, HEIGHT - 0.06, z - 0.12);
    both.append(&rail);
    Model::of(cloth, both)
}

/// The table and its chairs: eight at each side, one at each end, none quite as the other.
fn seats(stage: &mut Stage, palette: &Palette) {
    stage.add("table", furniture::table(palette));
    let chair = stage.mesh("chair", furniture::chair(palette));
    let mut random = Random::new(8);
    let mut number = 0;
    let mut seat = |stage: &mut Stage, place: Vec3, turn: f32| {
        number += 1;
        let pushed = vec3(random.range(-0.05, 0.05), 0.0, random.range(-0.06, 0.14));
        let swivel = random.range(-16.0, 16.0);
        stage.place(&format!("chair {number}"), chair, placed(place, turn) * placed(pushed, swivel));
    };
    for side in [1.0f32, -1.0] {
        for i in 0..8 {
            let x = (i as f32 - 3.5) * 0.77;
            let edge = furniture::half_width(x);
            seat(stage, vec3(x, 0.0, side * (edge + 0.3)), if side > 0.0 { 0.0 } else { 180.0 });
        }
    }
    for side in [1.0f32, -1.0] {
        seat(stage, vec3(side * (TABLE.0 + 0.33), 0.0, 0.0), 90.0 * side);
    }
}

/// Glass in the middle, paper before the seats, and what some have brought.
fn on_the_table(stage: &mut Stage, palette: &Palette) {
    let top = TABLE.2;
    let tray = stage.mesh("tray", things::tray(palette));
    let carafe = stage.mesh("carafe", Model::of(palette.glass, things::carafe()));
    let tumbler = stage.mesh("glass", Model::of(palette.glass, things::tumbler()));
    let mut glasses = 0;
    for (i, x) in [-2.15, -0.72, 0.72, 2.15].into_iter().enumerate() {
        let here = placed(vec3(x, top, 0.0), 23.0 * i as f32);
        let name = |part: &str| format!("{part} {}", i + 1);
        stage.place(&name("tray"), tray, here);
        stage.place(&name("carafe"), carafe, here * at(-0.06, 0.012, 0.0));
        for k in 0..3 {
            glasses += 1;
            let turn = 120.0 * k as f32;
            let place = vec3(0.105, 0.012, 0.0) + vec3(0.0, 0.0, 0.085 * (k as f32 - 1.0));
            stage.place(&format!("glass {glasses}"), tumbler, here * placed(place, turn));
        }
    }
    stage.mesh_at("bowl", fruit_bowl(palette.porcelain, palette.fruit, 24), at(0.0, top, 0.02));
    stage.mesh_at("telephone", things::telephone(palette), placed(vec3(-1.42, top, 0.0), 30.0));
    stage.mesh_at("telephone 2", things::telephone(palette), placed(vec3(1.42, top, 0.0), -15.0));
    let pad = stage.mesh("pad", things::pad(palette));
    let mut random = Random::new(77);
    let colors = [0x7a2f2a, 0x2d4a6e, 0x35604a, 0xb58b3d, 0x3a3d42];
    let books: Vec<u32> =
        colors.iter().map(|&hex| stage.mesh("notebook", things::notebook(palette, srgb(hex)))).collect();
    let laptop = things::laptop(stage, palette);
    let laptop = stage.mesh("laptop", laptop);
    for side in [1.0f32, -1.0] {
        for i in 0..8 {
            let x = (i as f32 - 3.5) * 0.77;
            let z = side * (furniture::half_width(x) - 0.21);
            let turn = if side > 0.0 { 0.0 } else { 180.0 };
            let here = placed(vec3(x, top, z), turn + random.range(-9.0, 9.0));
            let number = i + 1 + if side > 0.0 { 0 } else { 8 };
            match (number % 3, number % 5) {
                (1, _) => stage.place(&format!("laptop {number}"), laptop, here),
                (_, 2 | 4) => stage.place(&format!("notebook {number}"), books[number / 3 % books.len()], here),
                _ => stage.place(&format!("pad {number}"), pad, here),
            };
        }
    }
}

/// Sideboard under the mirror, plants in corners, a clock.
fn along_the_walls(stage: &mut Stage, palette: &Palette) {
    let (x, z) = HALF;
    let mut random = Random::new(41);
    stage.mesh_at("sideboard", furniture::sideboard(palette), at(0.6, 0.0, -z + 0.29));
    let frame = furniture::mirror(palette, vec2(3.6, 1.15));
    stage.mesh_at("mirror", frame, at(0.6, 1.72, -z + 0.034));
    let top = furniture::SIDEBOARD.1;
    let on = |along: f32, deep: f32| at(0.6 + along, top, -z + 0.27 + deep);
    stage.mesh_at("chrome ball", things::ball(palette.chrome, palette.dark, 0.17, (56, 28)), on(-1.12, 0.04));
    stage.mesh_at("glass ball", things::ball(palette.glass, palette.dark, 0.11, (48, 24)), on(-0.72, 0.08));
    let fern = fern((palette.clay, palette.leaf), 24, &mut random);
    stage.mesh_at("fern", fern, on(1.25, 0.0) * Mat4::from_scale(Vec3::splat(0.62)));
    let cup = stage.mesh("cup", cup(palette.porcelain, 24));
    for i in 0..6 {
        let place = vec3(0.05 + 0.13 * (i % 3) as f32, 0.0, 0.02 + 0.13 * (i / 3) as f32 - 0.06);
        stage.place(&format!("cup {}", i + 1), cup, on(0.0, 0.0) * placed(place, 35.0 * i as f32));
    }
    stage.mesh_at("pot", things::pot(palette), on(0.68, 0.05) * placed(Vec3::ZERO, -30.0));
    for (i, (px, pz, scale)) in
        [(x - 0.5, -z + 0.55, 1.0), (x - 0.5, z - 0.65, 0.9), (-x + 0.45, -z + 0.5, 0.95)].into_iter().enumerate()
    {
        let tree = tree((palette.clay, palette.leaf), 70, &mut random);
        let map = placed(vec3(px, 0.0, pz), 77.0 * i as f32) * Mat4::from_scale(Vec3::splat(scale));
        stage.mesh_at(&format!("plant {}", i + 1), tree, map);
    }
    stage.mesh_at("clock", things::clock(palette), placed(vec3(-x + 0.002, 2.32, -0.15), 90.0));
}

/// A whiteboard on one end wall, a screen on the other.
fn boards(stage: &mut Stage, palette: &Palette) {
    let x = HALF.0;
    let drawn = Picture::new(384, 192, |uv| {
        let p = uv * vec2(24.0, 12.0);
        let near = |d: f32, width: f32| d.abs() < width;
        let axes =
            (near(p.y - 10.4, 0.05) && p.x > 1.4 && p.x < 11.0) || (near(p.x - 1.5, 0.05) && p.y > 1.6 && p.y < 10.4);
        let fall = near(p.y - 2.2 - 7.6 * (1.0 - (-(p.x - 1.6) * 0.33).exp()), 0.09) && p.x > 1.6 && p.x < 10.6;
        let slow = near(p.y - 2.6 - 0.62 * (p.x - 1.6), 0.08) && p.x > 1.6 && p.x < 10.2;
        let lines = (2..9).any(|k| {
            let row = 1.1 * k as f32;
            let end = 13.5 + 8.5 * value_noise(vec2(row * 2.9, 1.5), 0, 15);
            p.x > 13.4 && p.x < end && near(p.y - row - 0.13 * (p.x * 8.0).sin() * value_noise(p * 3.0, 0, 6), 0.075)
        });
        let color = match (axes, fall, slow, lines) {
            (true, ..) => srgb(0x303439),
            (_, true, ..) => srgb(0xb02e28),
            (_, _, true, _) => srgb(0x2f7a46),
            (.., true) => srgb(0x29498e),
            _ => srgb(0xf2f2ef),
        };
        (color, 0.0)
    });
    let drawn = stage.pictured("whiteboard", &drawn, vec2(2.4, 1.2), 0.3);
    let mut face = Geometry::default();
    face.flat_quad([(0.0, 0.0), (2.4, 0.0), (2.4, 1.2), (0.0, 1.2)].map(|(u, v)| vec3(u, v, 0.0181)));
    let mut model = Model::of(drawn, face);
    model.add(palette.white, things::frame(vec2(2.4, 1.2), 0.03, 0.03).at(1.2, 0.6, 0.0));
    model.add(palette.white, bevel_box(0.9, 0.02, 0.09, 0.004).at(1.2, -0.04, 0.05));
    stage.mesh_at("whiteboard", model, placed(vec3(-x + 0.002, 0.95, 0.95), 90.0));

    let shown = Picture::new(320, 180, |uv| {
        let p = uv * vec2(16.0, 9.0);
        let bars = (0..6).any(|k| {
            let left = 1.6 + 1.5 * k as f32;
            let height = [4.6, 3.3, 2.5, 1.9, 1.3, 0.9][k];
            p.x > left && p.x < left + 0.9 && p.y < 7.6 && p.y > 7.6 - height
        });
        let rule = (p.y - 7.65).abs() < 0.04 && p.x > 1.2 && p.x < 11.0;
        let text = (0..4).any(|k| {
            let row = 3.2 + 1.1 * k as f32;
            p.x > 11.8 && p.x < 12.4 + 2.6 * value_noise(vec2(row * 5.1, 0.5), 0, 12) && (p.y - row).abs() < 0.13
        });
        let color = match (p.y < 1.5, bars, rule || text) {
            (true, ..) => srgb(0x1d4e6b),
            (_, true, _) => srgb(0xe58a2c).lerp(srgb(0x2a86a8), uv.x * 1.4),
            (.., true) => srgb(0x59646c),
            _ => srgb(0xd5dce0),
        };
        (color, 0.0)
    });
    let size = vec2(2.1, 2.1 * 9.0 / 16.0);
    let shown = stage.pictured("screen", &shown, size, 0.2);
    stage.scene.materials[shown as usize].unlit = true;
    let mut face = Geometry::default();
    face.flat_quad([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(u, v)| (vec2(u, v) * size).extend(0.0451)));
    let mut model = Model::of(shown, face);
    let body = bevel_box(size.x + 0.03, size.y + 0.03, 0.042, 0.006).at(0.5 * size.x, 0.5 * size.y, 0.023);
    model.add(palette.dark, body);
    stage.mesh_at("screen", model, placed(vec3(x - 0.002, 1.05, -1.05), -90.0));
    let title = lettering("CONFERENCE", srgb(0x1d4e6b), srgb(0xe6edf0), 3);
    let title = stage.pictured("title", &title, vec2(1.3, 0.26), 0.5);
    let mut face = Geometry::default();
    face.flat_quad([(0.0, 0.0), (1.3, 0.0), (1.3, 0.26), (0.0, 0.26)].map(|(u, v)| vec3(u, v, 0.0)));
    stage.mesh_at("title", Model::of(title, face), placed(vec3(x - 0.004, 2.38, -0.65), -90.0));
}

/// Four lamps over the table, a point light in the globe of each.
fn lamps(stage: &mut Stage, palette: &Palette) {
    let drop = 0.78;
    let lamp = stage.mesh("lamp", things::lamp(palette, drop));
    for (i, x) in [-2.4, -0.8, 0.8, 2.4].into_iter().enumerate() {
        let name = format!("lamp {}", i + 1);
        stage.place(&name, lamp, placed(vec3(x, HEIGHT - 0.045, 0.0), 40.0 * i as f32));
        stage.point(&name, [x, HEIGHT - 0.045 - drop, 0.0], srgb(0xfff1e0), LAMP);
    }
}
