//! A hall as of a church: a nave of 20 m between two rows of columns, an open roof, eleven windows with round arches, an apse
//! with an emblem, lamps on posts along the south wall, a lawn with a path and trees around. East is +X, north −Z. The sun
//! stands in the south-east, so that its light falls away along the north wall, which has windows only in its last two bays.
//!
//! The windows are open holes with tracery and no panes. About 190 000 triangles as drawn.

use super::kit::{
    Geometry, GradientSky, Model, Picture, Stage, at, bevel_box, bricks, cylinder, fbm, hash, mottled, placed, planks,
    slab, srgb, value_noise, veneer,
};
use glam::{Vec2, Vec3, vec2, vec3};
use lucerna::scene::{Material, Scene};

mod columns;
mod outside;
mod roof;
mod things;
mod walls;
mod windows;

use walls::{Arch, Wall};

/// Half the nave's inner length (x) and width (z), the height of the wall heads, and the walls' thickness.
const HALF: (f32, f32) = (10.0, 5.0);
const HEAD: f32 = 8.0;
const THICKNESS: f32 = 0.6;
/// How far the walls reach below the floor, and the height of the lawn.
const BASE: f32 = -0.5;
const GROUND: f32 = -0.15;
/// Number of bays, and the distance of the columns from the middle.
const BAYS: usize = 6;
const COLUMN: f32 = 3.4;
/// Compass bearing and elevation of the sun, degrees.
const SUN: (f32, f32) = (140.0, 40.0);
/// Irradiance of the sun on a facing plane, W/m².
const IRRADIANCE: f32 = 11.0;
/// Radiant intensity of a lamp, W/sr.
const LAMP: f32 = 0.6;
/// The apse: its middle (x), radius, and thickness.
const APSE: (f32, f32, f32) = (HALF.0 + 0.3, 2.4, 0.6);

/// Materials by number.
struct Palette {
    plaster: u32,
    stone: u32,
    ashlar: u32,
    oak: u32,
    boards: u32,
    slates: u32,
    iron: u32,
    gold: u32,
    enamel: u32,
    carpet: u32,
    linen: u32,
    bulb: u32,
}

/// Where bay `i` begins (x).
fn bay(i: usize) -> f32 {
    HALF.0 * (2.0 * i as f32 / BAYS as f32 - 1.0)
}

pub(super) fn build() -> Scene {
    let mut stage = Stage::new("hall");
    let palette = palette(&mut stage);
    floor(&mut stage, &palette);
    shell(&mut stage, &palette);
    columns::arcades(&mut stage, &palette);
    roof::roof(&mut stage, &palette);
    wainscot(&mut stage);
    banners(&mut stage, &palette);
    furniture(&mut stage, &palette);
    lamps(&mut stage, &palette);
    outside::outside(&mut stage, &palette);

    let (bearing, elevation) = (SUN.0.to_radians(), SUN.1.to_radians());
    let level = elevation.cos();
    let to_sun = vec3(bearing.sin() * level, elevation.sin(), -bearing.cos() * level);
    stage.sun(to_sun, srgb(0xfff0d8), IRRADIANCE);
    let sky = GradientSky {
        // Darker than by the sun, as in the garage: the sky must not flood the hall of a technique that lets it in.
        zenith: vec3(0.05, 0.095, 0.19),
        horizon: vec3(0.2, 0.235, 0.27),
        ground: vec3(0.08, 0.085, 0.055),
        to_sun,
        glow: vec3(0.28, 0.25, 0.19),
    };
    stage.scene.environment = Some(sky.environment("clear sky", 256, 128));

    stage.camera("nave", [-9.3, 1.75, 0.35], [2.0, 3.3, -0.35], 62.0);
    stage.camera("window", [-4.3, 1.7, -2.6], [-8.1, 1.35, 3.6], 60.0);
    stage.camera("outside", [-21.0, 1.75, 12.0], [-3.0, 4.6, 0.0], 52.0);
    stage.camera("lamps", [7.6, 1.7, -2.2], [-1.2, 2.0, 4.6], 56.0);
    stage.camera("north", [5.8, 1.7, 1.9], [-3.0, 2.3, -5.0], 58.0);
    stage.finish()
}

fn palette(stage: &mut Stage) -> Palette {
    let slates = Picture::new(256, 256, |uv| {
        let row = (uv.x * 8.0).floor();
        let along = uv.y * 8.0 + 0.5 * (row.rem_euclid(2.0));
        let tone = (hash((row as u32 * 31) ^ along.floor().rem_euclid(8.0) as u32) % 97) as f32 / 97.0;
        let edge = along.fract().min(1.0 - along.fract()).min((uv.x * 8.0).fract());
        let gap = (edge / 0.06).clamp(0.0, 1.0);
        (srgb(0x5b6068).lerp(srgb(0x454a54), tone) * (0.5 + 0.5 * gap), 0.006 * gap)
    });
    Palette {
        plaster: stage.textured("plaster", &mottled(128, 12, srgb(0xe9e3d5), srgb(0xded6c5), 0.0008, 101), 2.0, 0.95),
        stone: stage.textured("stone", &mottled(256, 24, srgb(0xcfc4ac), srgb(0xb5a98f), 0.0012, 102), 1.2, 0.9),
        ashlar: stage.textured("ashlar", &bricks(512, 4, 8, srgb(0x93846b), srgb(0x786d59), 103), 2.6, 0.95),
        oak: stage.textured("oak", &veneer(256, srgb(0xb58d60), srgb(0x7d5c3b), 104), 1.3, 0.6),
        boards: stage.textured("roof boards", &planks(256, 6, srgb(0xc8a274), srgb(0x98744c), 105), 1.5, 0.85),
        slates: stage.textured("slates", &slates, 1.8, 0.7),
        iron: stage.paint("iron", 0x2c2b2a, 0.5),
        gold: stage.metal("gilding", 0xd8ad55, 0.4),
        enamel: stage.paint("blue enamel", 0x3a66ad, 0.35),
        carpet: stage.textured("red cloth", &mottled(128, 48, srgb(0xa3261f), srgb(0x871c18), 0.0008, 106), 0.6, 1.0),
        linen: stage.paint("linen", 0xece7da, 0.9),
        bulb: stage.material(Material { unlit: true, ..Material::diffuse("lamp glass", srgb(0xfff0d6)) }),
    }
}

/// Tiles, the steps before the altar, and a runner down the middle.
fn floor(stage: &mut Stage, palette: &Palette) {
    let tiles = Picture::new(512, 512, |uv| {
        let p = uv * 4.0;
        let (cell, inside) = (p.floor(), p - p.floor());
        let edge = inside.min(Vec2::ONE - inside).min_element();
        let joint = ((edge - 0.008) / 0.012).clamp(0.0, 1.0);
        let own = (hash(cell.x as u32 * 7 + cell.y as u32 * 131 + 9) % 89) as f32 / 89.0;
        let grain = fbm(uv * 16.0, 16, 4, 107);
        let even = (cell.x + cell.y) as i32 % 2 == 0;
        let (light, dark) = if even { (srgb(0xcbbfa8), srgb(0xb7aa92)) } else { (srgb(0xa08e7a), srgb(0x8b7a67)) };
        let stone = light.lerp(dark, 0.5 * own + 0.5 * grain) * (0.94 + 0.12 * value_noise(uv * 128.0, 128, 108));
        (stone.lerp(srgb(0x5d5549), 1.0 - joint), 0.002 * joint + 0.0006 * grain)
    });
    let tiles = stage.textured("tiles", &tiles, 2.4, 0.6);
    let (x, z) = (HALF.0 + 0.3, HALF.1 + 0.3);
    stage.add("floor", Model::of(tiles, slab([-x, BASE, -z], [x, 0.0, z])));
    let mut steps = bevel_box(4.6, 0.3, 5.9, 0.012).at(8.3, 0.0, 0.0);
    steps.append(&bevel_box(4.2, 0.3, 5.6, 0.012).at(8.55, 0.15, 0.0));
    stage.add("steps", Model::of(tiles, steps));
    let mut choir = cylinder(APSE.1 + 0.1, 0.55, 64).at(APSE.0, -0.1, 0.0);
    choir.append(&slab([APSE.0 - 0.1, BASE, -APSE.1], [APSE.0 + 1.4, -0.05, APSE.1]));
    stage.add("choir", Model::of(palette.stone, choir));
    stage.add("runner", Model::of(palette.carpet, bevel_box(14.2, 0.014, 1.25, 0.005).at(-1.2, 0.006, 0.0)));
}

/// Four walls with their windows, the door, the apse.
fn shell(stage: &mut Stage, palette: &Palette) {
    // Walls reach into the roof, and end walls into the long ones.
    let top = |z: f32| roof::underside(z) + 0.14;
    let length = 2.0 * (HALF.0 + THICKNESS) - 0.06;
    let middle = |i: usize| bay(i) + HALF.0 / BAYS as f32;
    let light = |middle: f32, half: f32| Arch { middle, half, bottom: 1.8, spring: 5.5 };
    let along = |_: f32, behind: f32| top(HALF.1 - behind);
    let long = |arches: &[Arch]| {
        let wall = Wall { width: length, base: BASE, thickness: THICKNESS, top: &along, kinks: &[], arches };
        wall.build(palette.plaster, palette.ashlar)
    };
    let south: Vec<Arch> = (0..BAYS).rev().map(|i| light(0.5 * length - middle(i), 1.0)).collect();
    let north: Vec<Arch> = (BAYS - 2..BAYS).map(|i| light(0.5 * length + middle(i), 1.0)).collect();
    let south_at = placed(vec3(0.5 * length, 0.0, HALF.1), 180.0);
    let north_at = at(-0.5 * length, 0.0, -HALF.1);
    stage.mesh_at("south wall", long(&south), south_at);
    stage.mesh_at("north wall", long(&north), north_at);

    let half = HALF.1 + 0.35;
    let gable = |x: f32, _: f32| top((x - half).clamp(-half, half));
    let end = |arches: &[Arch]| {
        let wall = Wall { width: 2.0 * half, base: BASE, thickness: THICKNESS, top: &gable, kinks: &[half], arches };
        wall.build(palette.plaster, palette.ashlar)
    };
    let large = Arch { middle: half, half: 1.5, bottom: 4.2, spring: 7.0 };
    let entry = Arch { middle: half, half: 1.0, bottom: 0.0, spring: 2.2 };
    let chancel = Arch { middle: half, half: APSE.1 - 0.2, bottom: BASE, spring: 4.3 };
    let beside = [-4.25, 4.25].map(|z| light(half + z, 0.4));
    let west_at = placed(vec3(-HALF.0, 0.0, half), 90.0);
    let east_at = placed(vec3(HALF.0, 0.0, -half), -90.0);
    stage.mesh_at("west wall", end(&[large, entry]), west_at);
    stage.mesh_at("east wall", end(&[chancel, beside[0], beside[1]]), east_at);
    stage.mesh_at("door", things::door(palette, &entry), west_at * at(0.0, 0.0, -0.3));

    let deep = at(0.0, 0.0, -0.4);
    let centred = Arch { middle: 0.0, ..south[0] };
    let window = stage.mesh("window", windows::window(palette, &centred, 1, 0.035));
    for (side, wall, arches) in [("south", south_at, &south), ("north", north_at, &north)] {
        for (i, arch) in arches.iter().enumerate() {
            stage.place(&format!("{side} window {}", i + 1), window, wall * at(arch.middle, 0.0, 0.0) * deep);
        }
    }
    stage.mesh_at("west window", windows::window(palette, &large, 2, 0.04), west_at * deep);
    for (i, arch) in beside.iter().enumerate() {
        let window = windows::window(palette, arch, 1, 0.025);
        stage.mesh_at(&format!("east window {}", i + 1), window, east_at * deep);
    }
    apse(stage, palette);
}

/// Half a drum under half a dome, and a cone of slates over it.
fn apse(stage: &mut Stage, palette: &Palette) {
    let (middle, radius, thick) = APSE;
    let (spring, steps) = (4.5, 14);
    // Well above the dome.
    let cone = |r: f32| 8.5 - 0.967 * r;
    let mut inner = vec![vec2(radius, BASE)];
    let mut outer = vec![vec2(radius + thick, BASE)];
    for i in 0..=steps {
        let t = i as f32 / steps as f32;
        let (sin, cos) = (t * std::f32::consts::FRAC_PI_2).sin_cos();
        inner.push(vec2(if i == steps { 0.0 } else { radius * cos }, spring + radius * sin));
        outer.push(vec2((radius + thick) * (1.0 - t), cone((radius + thick) * (1.0 - t))));
    }
    let shell = walls::half_shell(&inner, &outer, 48, palette.plaster, palette.ashlar);
    stage.mesh_at("apse", shell, at(middle, 0.0, 0.0));
    let line = |rise: f32| [3.3, 1.65, 0.0].map(|r| vec2(r, cone(r) + rise));
    let cover = walls::half_shell(&line(-0.03), &line(0.12), 48, palette.slates, palette.slates);
    stage.mesh_at("apse roof", cover, at(middle, 0.0, 0.0));
    stage.mesh_at("emblem", things::emblem(palette, 0.85), at(middle + radius - 0.32, 4.0, 0.0));
}

/// Boards of a colour along the foot of the walls.
fn wainscot(stage: &mut Stage) {
    let grain = planks(256, 8, srgb(0x4f7d74), srgb(0x36605a), 109);
    let paint = stage.textured("green boards", &grain, 1.6, 0.6);
    let high = 1.15;
    let mut out = Geometry::default();
    // A run of `length` from the origin along +X on a wall that faces +Z.
    let run = |length: f32| {
        let mut one = slab([0.0, -0.02, -0.02], [length, high, 0.03]);
        let count = (length / 0.42).round().max(1.0) as usize;
        let pitch = length / count as f32;
        for i in 0..count {
            let panel = bevel_box(pitch - 0.12, high - 0.4, 0.02, 0.008);
            one.append(&panel.at((i as f32 + 0.5) * pitch, 0.5 * high + 0.03, 0.034));
        }
        one.append(&bevel_box(length, 0.06, 0.09, 0.015).at(0.5 * length, high, 0.03));
        one.append(&bevel_box(length, 0.16, 0.06, 0.012).at(0.5 * length, 0.08, 0.025));
        one
    };
    let (x, z) = HALF;
    out.append(&run(2.0 * x).at(-x, 0.0, -z));
    out.append(&run(2.0 * x).turned_y(180.0).at(x, 0.0, z));
    let side = z - 0.04 - 1.12;
    out.append(&run(side).turned_y(90.0).at(-x, 0.0, z - 0.04));
    out.append(&run(side).turned_y(90.0).at(-x, 0.0, -1.12));
    let beside = z - 0.04 - 2.32;
    out.append(&run(beside).turned_y(-90.0).at(x, 0.0, -z + 0.04));
    out.append(&run(beside).turned_y(-90.0).at(x, 0.0, 2.32));
    stage.add("wainscot", Model::of(paint, out));
}

/// Red and blue banners on the north wall, where it has no windows.
fn banners(stage: &mut Stage, palette: &Palette) {
    let size = vec2(1.15, 3.45);
    let cloth = [("red banner", 0xa8231f, false), ("blue banner", 0x1f4391, true)].map(|(name, field, round)| {
        let cloth = stage.pictured(name, &things::heraldry(field, round), size, 0.95);
        stage.scene.materials[cloth as usize].double_sided = true;
        let model = things::banner(palette, cloth, size, 110 + u32::from(round));
        (name, stage.mesh(name, model))
    });
    for i in 0..4 {
        let (name, mesh) = cloth[i % 2];
        let x = bay(i) + HALF.0 / BAYS as f32;
        stage.place(&format!("{name} {}", i / 2 + 1), mesh, at(x, 5.0, -HALF.1 + 0.02));
    }
}

fn furniture(stage: &mut Stage, palette: &Palette) {
    let length = 2.05;
    let pew = stage.mesh("pew", things::pew(palette, length));
    let mut number = 0;
    for row in 0..10 {
        for side in [-1.0, 1.0] {
            number += 1;
            let place = vec3(-4.7 + 0.98 * row as f32, 0.0, side * (0.86 + 0.5 * length));
            stage.place(&format!("pew {number}"), pew, at(place.x, place.y, place.z));
        }
    }
    stage.mesh_at("altar", things::altar(palette), at(9.35, 0.45, 0.0));
    stage.mesh_at("font", things::font(palette), at(-7.3, 0.0, -2.1));
    stage.mesh_at("lectern", things::lectern(palette), placed(vec3(6.95, 0.3, 2.1), 172.0));
}

/// Posts with lamps along the south wall, between its windows.
fn lamps(stage: &mut Stage, palette: &Palette) {
    let post = stage.mesh("lamp", things::lamp(palette));
    for i in 1..BAYS {
        let place = Vec3::new(bay(i), 0.0, HALF.1 - 0.62);
        stage.place(&format!("lamp {i}"), post, placed(place, 37.0 * i as f32));
        stage.point(&format!("lamp {i}"), [place.x, things::BULB, place.z], srgb(0xffe2b4), LAMP);
    }
}
