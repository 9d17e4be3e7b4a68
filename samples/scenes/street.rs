//! A western street at mid-morning: wooden buildings with porches along a dusty road, a church at its end, hills,
//! trees, grass and cacti around. Made for open-space tests: far views, thin things, masked leaves.
//!
//! The road runs along Z; the buildings on its left (−X) get the sun.

use super::kit::{
    Geometry, GradientSky, Model, Picture, Random, Stage, at, bricks, fbm, lettering, mottled, placed, planks, srgb,
    terrain, value_noise,
};
use glam::{Mat4, Vec2, Vec3, vec2, vec3};
use lucerna::scene::{AlphaMode, Material, Sampler, Scene, Texture, TextureRef, Wrap};
use std::f32::consts::TAU;

mod buildings;
mod things;
mod vegetation;

use buildings::{Plan, WALK};

/// Half the side of the ground.
const REACH: f32 = 88.0;
/// Where the fronts stand (±x), and the height of the boardwalks above the road.
const FRONT: f32 = 8.4;
const STEP: f32 = 0.36;

/// Materials by number.
struct Palette {
    wood: u32,
    shingles: u32,
    brick: u32,
    glass: u32,
    iron: u32,
    tin: u32,
    canvas: u32,
    water: u32,
    porcelain: u32,
}

pub(super) fn build() -> Scene {
    let mut stage = Stage::new("street");
    let palette = palette(&mut stage);
    land(&mut stage);
    town(&mut stage, &palette);
    things_in_the_street(&mut stage, &palette);
    wires(&mut stage, &palette);
    plants(&mut stage);

    let to_sun = vec3(0.66, 0.62, 0.5).normalize();
    stage.sun(to_sun, srgb(0xfff0d2), 3.6);
    let sky = GradientSky {
        zenith: vec3(0.09, 0.2, 0.46),
        horizon: vec3(0.55, 0.62, 0.68),
        ground: vec3(0.28, 0.2, 0.13),
        to_sun,
        glow: vec3(0.9, 0.78, 0.58),
    };
    stage.scene.environment = Some(sky.environment("desert sky", 512, 256));

    stage.camera("street", [0.9, 1.75, 41.0], [-0.6, 3.0, -8.0], 50.0);
    stage.camera("saloon", [2.6, 1.7, 15.5], [-8.6, 3.1, 25.0], 52.0);
    stage.camera("boardwalk", [-7.35, 2.05, 16.8], [-7.15, 1.75, -10.0], 58.0);
    stage.camera("rooftops", [19.0, 14.0, 44.0], [-3.0, 1.5, -2.0], 46.0);
    let hill = vec2(-37.0, 34.0);
    stage.camera("outskirts", [hill.x, ground(hill) + 1.9, hill.y], [-8.0, 3.4, 4.0], 46.0);
    stage.camera("wagon", [5.0, 1.6, 2.4], [-0.7, 1.35, -3.0], 52.0);
    stage.finish()
}

fn palette(stage: &mut Stage) -> Palette {
    let weathered = planks(256, 5, srgb(0xf2efe8), srgb(0xb9b2a6), 71);
    let rows = Picture::new(256, 256, |uv| {
        let row = (uv.y * 4.0).floor();
        let x = uv.x * 8.0 + value_noise(vec2(row * 3.1, 0.5), 0, 72) * 5.0;
        let tone = value_noise(vec2(x.floor().rem_euclid(8.0) * 7.7, row * 5.3), 0, 73);
        let gap = ((x.fract().min(1.0 - x.fract()) - 0.02) / 0.05).clamp(0.0, 1.0);
        let grain = value_noise(vec2(uv.x * 128.0, uv.y * 12.0), 0, 74);
        (srgb(0x8a7663).lerp(srgb(0x5f5148), tone) * (0.75 + 0.4 * grain) * (0.4 + 0.6 * gap), 0.004 * gap)
    });
    let cloth = mottled(128, 20, srgb(0xe4d9bf), srgb(0xcfc2a4), 0.001, 75);
    let canvas = stage.textured("canvas", &cloth, 1.0, 0.95);
    stage.scene.materials[canvas as usize].double_sided = true;
    Palette {
        wood: stage.textured("weathered wood", &weathered, 1.1, 0.85),
        shingles: stage.textured("shingles", &rows, 1.6, 0.9),
        brick: stage.textured("chimney brick", &bricks(256, 4, 12, srgb(0x96503a), srgb(0xa89c8a), 76), 1.0, 0.9),
        glass: stage.paint("window glass", 0x1d2529, 0.08),
        iron: stage.paint("wrought iron", 0x2e2a28, 0.55),
        tin: stage.metal("galvanised tin", 0xa9adb0, 0.45),
        canvas,
        water: stage.paint("water", 0x28362f, 0.05),
        porcelain: stage.paint("porcelain", 0xdfe6e6, 0.2),
    }
}

fn smooth(low: f32, high: f32, x: f32) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Height of the ground at (x, z).
fn ground(p: Vec2) -> f32 {
    let edge = vec2((p.x.abs() - 20.0).max(0.0), (p.y.abs() - 52.0).max(0.0)).length();
    let bumps = 0.12 * (fbm(p * 0.35, 0, 3, 80) - 0.5) * smooth(4.0, 9.0, p.x.abs());
    let hills = smooth(0.0, 40.0, edge) * (7.0 * fbm(p * 0.045, 0, 4, 81) - 1.8);
    let mesa = smooth(0.56, 0.66, fbm(p * 0.028 + vec2(3.7, 9.2), 0, 3, 82)) * smooth(22.0, 42.0, edge);
    let layers = 12.0 * mesa + 0.8 * (mesa * 14.0).sin() * mesa * (1.0 - mesa);
    // Two ruts that wander, and a low crown between them.
    let wander = p.x - 0.9 * (p.y * 0.07).sin();
    let rut = |at: f32| (-((wander - at) / 0.2).powi(2)).exp();
    let road = smooth(5.5, 4.0, p.x.abs()) * smooth(58.0, 48.0, p.y.abs());
    let fine = 0.03 * value_noise(p * 1.7, 0, 83);
    bumps + hills + layers + road * (0.05 - 0.075 * (rut(-0.8) + rut(0.8)) + fine)
}

/// The ground, finer along the road, coloured by place and slope.
fn land(stage: &mut Stage) {
    // Lines gather around the road: near spacing 0.3 m, far 3 m.
    let warp = |c: f32, near: f32| REACH * (near * c + (1.0 - near) * c * c * c);
    let mut sheet = terrain(vec2(-1.0, -1.0), vec2(1.0, 1.0), 152, 148, |_| 0.0).displaced(|p| {
        let (x, z) = (warp(p.x, 0.3), warp(p.z, 0.62));
        vec3(x, ground(vec2(x, z)), z)
    });
    sheet.uvs = sheet.positions.iter().map(|p| vec2(p.x, p.z)).collect();
    let color = |p: Vec3, up: f32| {
        let q = vec2(p.x, p.z);
        let sand = srgb(0xcaa276).lerp(srgb(0xb88c60), fbm(q * 0.3, 0, 3, 84));
        let dry = srgb(0xa89a5a).lerp(srgb(0x86883f), fbm(q * 0.5, 0, 2, 85));
        let meadow = smooth(0.48, 0.62, fbm(q * 0.09, 0, 3, 86)) * smooth(9.0, 20.0, p.x.abs().max(p.z.abs() - 40.0));
        let rock = srgb(0xb06a44).lerp(srgb(0x8a4a32), 0.5 + 0.5 * (p.y * 2.3 + 1.5 * fbm(q * 0.2, 0, 2, 87)).sin());
        let dust = srgb(0xd0b088);
        let road = smooth(6.5, 4.5, p.x.abs()) * smooth(60.0, 48.0, p.z.abs());
        let soil = sand.lerp(dry, meadow).lerp(dust, road * 0.8);
        soil.lerp(rock, smooth(0.9, 0.72, up))
    };
    sheet.colors = sheet.positions.iter().zip(&sheet.normals).map(|(p, n)| color(*p, n.y).extend(1.0)).collect();
    let gravel = Picture::new(512, 512, |uv| {
        let fine = value_noise(uv * 128.0, 128, 88);
        let broad = fbm(uv * 8.0, 8, 4, 89);
        let pebble = smooth(0.8, 0.9, value_noise(uv * 48.0, 48, 90));
        (
            Vec3::splat((0.62 + 0.3 * broad + 0.16 * fine - 0.1 * pebble).min(1.0)),
            0.006 * broad + 0.002 * fine + 0.008 * pebble,
        )
    });
    let soil = stage.textured("soil", &gravel, 4.0, 0.95);
    stage.add("ground", Model::of(soil, sheet));
}

/// Buildings of one side from +Z to −Z: gap before it, plan.
fn row(stage: &mut Stage, left: bool) -> Vec<(f32, Plan)> {
    let mut sign = |text: &str, board: u32, ink: u32, height: f32| {
        let picture = lettering(text, srgb(board), srgb(ink), 91);
        let size = (height * picture.width as f32 / picture.height as f32, height);
        Some((stage.pictured(&format!("sign {text}"), &picture, vec2(size.0, size.1), 0.8), size))
    };
    let plan = |name, (width, depth), (walls, front), storeys, (paint, trim), sign| Plan {
        name,
        width,
        depth,
        walls,
        front,
        storeys,
        paint,
        trim,
        porch: true,
        sign,
    };
    if left {
        vec![
            (
                0.0,
                plan(
                    "saloon",
                    (12.0, 13.0),
                    (6.2, 7.9),
                    2,
                    (0xa8472f, 0xe8dcc0),
                    sign("SALOON", 0x2f2018, 0xe9b949, 0.95),
                ),
            ),
            (
                2.6,
                plan("bank", (8.0, 11.0), (3.9, 6.0), 1, (0xcdb98c, 0x5b3a26), sign("BANK", 0x24382e, 0xe6d8b0, 0.85)),
            ),
            (
                0.4,
                plan(
                    "barber",
                    (6.4, 9.0),
                    (3.5, 4.9),
                    1,
                    (0x6f93a0, 0xe9e4d6),
                    sign("BARBER", 0xe6dfcc, 0x9a2f28, 0.55),
                ),
            ),
            (
                4.2,
                plan(
                    "assay office",
                    (8.2, 10.0),
                    (3.7, 5.3),
                    1,
                    (0x9a8a63, 0x463423),
                    sign("ASSAY OFFICE", 0x3b2a1c, 0xe3d1a4, 0.48),
                ),
            ),
            (
                1.6,
                plan(
                    "livery",
                    (12.0, 15.0),
                    (4.6, 7.0),
                    1,
                    (0x7d3b2a, 0xd9cbb0),
                    sign("LIVERY", 0xd9cbb0, 0x4a2a1e, 0.85),
                ),
            ),
        ]
    } else {
        vec![
            (
                0.6,
                plan(
                    "general store",
                    (10.4, 12.0),
                    (4.0, 5.9),
                    1,
                    (0x7f9a6b, 0xe8dfc6),
                    sign("GENERAL STORE", 0x3a2a1c, 0xe8c872, 0.55),
                ),
            ),
            (
                1.2,
                plan(
                    "sheriff",
                    (7.0, 9.0),
                    (3.6, 5.0),
                    1,
                    (0xb59a6e, 0x4f3a28),
                    sign("SHERIFF", 0xe4dcc6, 0x2f2a26, 0.6),
                ),
            ),
            (
                3.8,
                plan(
                    "hotel",
                    (12.4, 13.0),
                    (6.3, 8.2),
                    2,
                    (0xd8c8a6, 0x7b3f2c),
                    sign("HOTEL", 0x5b2f24, 0xf0e2bd, 1.0),
                ),
            ),
            (
                1.0,
                plan(
                    "post office",
                    (7.6, 9.5),
                    (3.6, 5.2),
                    1,
                    (0x93765a, 0xe6dcc4),
                    sign("POST OFFICE", 0x26323f, 0xe9dfc4, 0.48),
                ),
            ),
            (
                4.4,
                plan(
                    "gunsmith",
                    (7.2, 9.0),
                    (3.5, 5.1),
                    1,
                    (0x8c6a86, 0x3c2a22),
                    sign("GUNSMITH", 0xe0d3b4, 0x3a2620, 0.55),
                ),
            ),
        ]
    }
}

fn town(stage: &mut Stage, palette: &Palette) {
    let mut random = Random::new(100);
    for left in [true, false] {
        let side = if left { -1.0 } else { 1.0 };
        let mut z = 32.0;
        for (gap, plan) in row(stage, left) {
            z -= gap + plan.width * 0.5;
            let place = placed(vec3(side * FRONT, STEP, z), -side * 90.0);
            let model = buildings::building(palette, &plan, &mut random);
            stage.mesh_at(plan.name, model, place);
            let walk = buildings::boardwalk(palette, plan.width + 0.3, &mut random);
            stage.mesh_at(&format!("{} boardwalk", plan.name), walk, place);
            z -= plan.width * 0.5;
        }
    }
    stage.mesh_at("church", buildings::church(palette, &mut random), at(-1.0, 0.55, -47.0));
    let tower = buildings::water_tower(palette, 6.5, &mut random);
    let spot = vec2(24.5, 11.0);
    stage.mesh_at("water tower", tower, at(spot.x, ground(spot), spot.y));
    let spot = vec2(-27.0, 8.5);
    stage.mesh_at("wind wheel", things::wind_wheel(palette, 9.0), placed(vec3(spot.x, ground(spot), spot.y), 38.0));
}

fn things_in_the_street(stage: &mut Stage, palette: &Palette) {
    let mut random = Random::new(7);
    let near = FRONT - 0.75;
    let barrel = stage.mesh("barrel", things::barrel(palette));
    let barrels = [
        (-near, 19.9),
        (-near + 0.1, 19.15),
        (-near, 9.2),
        (-near, -9.5),
        (near, 24.2),
        (near - 0.15, 23.5),
        (near, 11.7),
        (near, -6.8),
        (near, -14.0),
    ];
    for (i, (x, z)) in barrels.into_iter().enumerate() {
        stage.place(&format!("barrel {}", i + 1), barrel, placed(vec3(x, STEP, z), 67.0 * i as f32));
    }
    let boxes = [0.8, 0.6].map(|size| stage.mesh("crate", things::crate_of_boards(palette, size, &mut random)));
    let crates = [
        (near, STEP, 29.6, 0, 8.0),
        (near, STEP, 28.6, 1, -12.0),
        (near, STEP + 0.8, 29.55, 1, 24.0),
        (-near, STEP, -21.4, 0, 5.0),
    ];
    for (i, (x, y, z, kind, turn)) in crates.into_iter().enumerate() {
        stage.place(&format!("crate {}", i + 1), boxes[kind], placed(vec3(x, y, z), turn));
    }
    let burlap = stage.textured("burlap", &mottled(64, 24, srgb(0xc7a877), srgb(0xa98c5f), 0.001, 92), 0.3, 0.95);
    let sack = stage.mesh("sack", Model::of(burlap, things::sack()));
    for (i, (x, z)) in [(near, 26.4), (near + 0.1, 25.8), (near - 0.1, 27.0)].into_iter().enumerate() {
        stage.place(&format!("sack {}", i + 1), sack, placed(vec3(x, STEP, z), 90.0 + 21.0 * i as f32));
    }
    stage.mesh_at("wagon", things::wagon(palette, &mut random), placed(vec3(0.3, 0.0, -2.0), 108.0));
    let rail = stage.mesh("hitching rail", things::hitching_rail(palette, 3.2));
    let edge = FRONT - WALK - 0.7;
    for (i, (side, z)) in
        [(-1.0, 28.5), (-1.0, 14.2), (-1.0, -13.5), (1.0, 17.0), (1.0, 3.5), (1.0, -19.5)].into_iter().enumerate()
    {
        stage.place(&format!("hitching rail {}", i + 1), rail, placed(vec3(side * edge, 0.0, z), 90.0));
    }
    let trough = stage.mesh("trough", things::trough(palette, 2.2));
    for (i, (side, z)) in [(-1.0, 23.5), (1.0, -2.2)].into_iter().enumerate() {
        stage.place(&format!("trough {}", i + 1), trough, placed(vec3(side * (edge - 0.1), 0.02, z), 90.0));
    }
    let bench = stage.mesh("bench", things::bench(palette, 1.7));
    for (i, (side, z)) in [(-1.0, 12.4), (1.0, 15.2), (1.0, -9.5), (-1.0, -7.0)].into_iter().enumerate() {
        stage.place(&format!("bench {}", i + 1), bench, placed(vec3(side * (FRONT - 0.42), STEP, z), -side * 90.0));
    }
    let lantern = stage.mesh("lantern", things::lantern(palette));
    for (i, (side, z)) in
        [(-1.0, 28.0), (-1.0, 24.0), (1.0, 5.5), (1.0, 1.0), (1.0, 26.0), (-1.0, 13.4)].into_iter().enumerate()
    {
        stage.place(&format!("lantern {}", i + 1), lantern, at(side * (FRONT - WALK * 0.55), STEP + 2.62, z));
    }
}

/// Telegraph poles along the right side behind the walk, with their wires.
fn wires(stage: &mut Stage, palette: &Palette) {
    let pole = stage.mesh("telegraph pole", things::pole(palette, 7.5));
    let spots: Vec<Vec3> = (0..6)
        .map(|i| {
            let p = vec2(4.9, 46.0 - 19.0 * i as f32);
            vec3(p.x, ground(p), p.y)
        })
        .collect();
    for (i, p) in spots.iter().enumerate() {
        stage.place(&format!("telegraph pole {}", i + 1), pole, Mat4::from_translation(*p));
    }
    let mut lines = Geometry::default();
    for pair in spots.windows(2) {
        for x in [-0.75, 0.75] {
            let end = vec3(x, 7.5 - 0.27, 0.11);
            lines.append(&things::wire(pair[0] + end, pair[1] + end));
        }
    }
    stage.add("wires", Model::of(palette.iron, lines));
}

/// A material of masked cards.
fn cards(stage: &mut Stage, name: &str, texture: Texture, double_sided: bool) -> u32 {
    stage.scene.textures.push(texture);
    let sampler = Sampler { wrap_u: Wrap::ClampToEdge, wrap_v: Wrap::ClampToEdge, ..Sampler::default() };
    let picture = TextureRef { sampler, ..TextureRef::new(stage.scene.textures.len() as u32 - 1) };
    stage.material(Material {
        base_color_texture: Some(picture),
        alpha: AlphaMode::Mask { cutoff: 0.5 },
        double_sided,
        roughness: 0.85,
        ..Material::diffuse(name, Vec3::ONE)
    })
}

/// Whether plants may stand at (x, z): off the road, the walks, the buildings and the church.
fn free(p: Vec2) -> bool {
    let town = p.x.abs() < 24.5 && p.x.abs() > 5.2 && p.y > -28.0 && p.y < 33.5;
    let road = p.x.abs() < 5.2 && p.y > -46.0 && p.y < 60.0;
    let church = (p.x + 1.0).abs() < 5.5 && p.y < -44.0 && p.y > -62.0;
    !(town || road || church)
}

fn plants(stage: &mut Stage) {
    let mut random = Random::new(5);
    let somewhere = |random: &mut Random, reach: f32| loop {
        let p = vec2(random.range(-reach, reach), random.range(-reach, reach));
        if free(p) {
            return p;
        }
    };
    let on_ground = |p: Vec2| vec3(p.x, ground(p), p.y);

    let bark = stage.textured("bark", &mottled(128, 14, srgb(0x8a7259), srgb(0x57442f), 0.02, 95), 0.6, 0.95);
    let leaf = cards(stage, "leaves", vegetation::leaf_picture(), true);
    let kinds: Vec<u32> = [7.2, 6.0, 8.4]
        .into_iter()
        .enumerate()
        .map(|(i, height)| {
            let (wood, crown) = vegetation::tree(height, &mut random);
            let mut model = Model::of(bark, wood);
            model.add(leaf, crown);
            stage.mesh(&format!("tree {}", i + 1), model)
        })
        .collect();
    let trees = [
        (10.5, -34.0),
        (-10.8, -37.0),
        (-27.0, -16.0),
        (27.5, -8.0),
        (-28.5, 27.0),
        (13.5, 39.0),
        (-12.5, 41.5),
        (29.0, 30.0),
        (16.0, -50.0),
        (-19.0, -52.0),
    ];
    for (i, (x, z)) in trees.into_iter().enumerate() {
        let size = Mat4::from_scale(Vec3::splat(0.9 + 0.04 * (i % 5) as f32));
        stage.place(&format!("tree {}", i + 1), kinds[i % 3], placed(on_ground(vec2(x, z)), 73.0 * i as f32) * size);
    }
    let bushes: Vec<u32> = (0..2)
        .map(|i| stage.mesh("bush", Model::of(leaf, vegetation::bush(1.3 + 0.4 * i as f32, 70, &mut random))))
        .collect();
    for i in 0..36 {
        let p = somewhere(&mut random, 60.0);
        let size = Mat4::from_scale(Vec3::splat(random.range(0.6, 1.2)));
        stage.place(&format!("bush {}", i + 1), bushes[i % 2], placed(on_ground(p), random.range(0.0, 360.0)) * size);
    }

    let blade = cards(stage, "grass", vegetation::grass_picture(), false);
    // Tufts gather where the ground is greener, and a few stand along the walks.
    let mut tufts: Vec<Vec3> = Vec::new();
    while tufts.len() < 3300 {
        let p = somewhere(&mut random, 62.0);
        if random.unit() < 0.15 + smooth(0.42, 0.6, fbm(p * 0.09, 0, 3, 86)) {
            tufts.push(on_ground(p));
        }
    }
    for _ in 0..160 {
        let side = if random.unit() < 0.5 { -1.0 } else { 1.0 };
        tufts.push(on_ground(vec2(side * random.range(5.3, 5.9), random.range(-27.0, 32.0))));
    }
    stage.add("grass", Model::of(blade, vegetation::grass(&tufts, &mut random)));

    let flesh = stage.textured("cactus skin", &mottled(64, 12, srgb(0x6c8a4e), srgb(0x4b6a3a), 0.0, 96), 0.5, 0.8);
    let cacti: Vec<u32> = [(4.2, 3), (3.2, 2), (2.2, 1)]
        .into_iter()
        .map(|(height, arms)| stage.mesh("cactus", Model::of(flesh, vegetation::cactus(height, arms, &mut random))))
        .collect();
    for i in 0..13 {
        let p = if i == 0 { vec2(-33.5, 27.5) } else { somewhere(&mut random, 55.0) };
        stage.place(&format!("cactus {}", i + 1), cacti[i % 3], placed(on_ground(p), random.range(0.0, 360.0)));
    }
    let stone = stage.textured("sandstone", &mottled(128, 10, srgb(0xb87a52), srgb(0x8f5a3e), 0.01, 97), 1.2, 0.95);
    let rocks: Vec<u32> =
        (0..3).map(|i| stage.mesh("rock", Model::of(stone, vegetation::rock(1.6, 40 + 9 * i)))).collect();
    for i in 0..38 {
        let p = somewhere(&mut random, 70.0);
        let size = random.range(0.25, 1.0f32).powi(2) * 1.8 + 0.15;
        let map = placed(on_ground(p) + Vec3::Y * size * 0.2, random.range(0.0, 360.0))
            * Mat4::from_scale(vec3(size, size * 0.8, size));
        stage.place(&format!("rock {}", i + 1), rocks[i % 3], map);
    }
    let sage = stage.paint("sagebrush", 0x8f9a78, 0.95);
    let scrub: Vec<u32> =
        (0..2).map(|i| stage.mesh("scrub", Model::of(sage, vegetation::scrub(0.55, 50 + i)))).collect();
    for i in 0..70 {
        let p = somewhere(&mut random, 82.0);
        let size = Mat4::from_scale(Vec3::splat(random.range(0.4, 1.3)));
        stage.place(&format!("scrub {}", i + 1), scrub[i % 2], placed(on_ground(p), random.range(0.0, 360.0)) * size);
    }
    let straw = stage.paint("tumbleweed", 0xa98a55, 0.95);
    let weed = stage.mesh("tumbleweed", Model::of(straw, vegetation::tumbleweed(0.8, &mut random)));
    for (i, (x, z)) in [(2.9, 20.5), (-2.4, -14.0), (3.6, -27.0)].into_iter().enumerate() {
        stage.place(&format!("tumbleweed {}", i + 1), weed, placed(on_ground(vec2(x, z)), TAU * 30.0 * i as f32));
    }
}
