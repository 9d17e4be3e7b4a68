//! The Utah teapot with two cups on a table by a coloured wall.

use super::kit::{
    Geometry, GradientSky, Model, Opening, Stage, at, bevel_box, frustum, lathe, mottled, placed, planks, sheet, slab,
    sphere, srgb, sweep, wall,
};
use glam::{Mat4, Vec2, Vec3, vec2, vec3};
use lucerna::scene::{Material, Scene};

mod patches;

/// Metres a unit of the patch data: a pot of 19 cm.
const SCALE: f32 = 0.06;
/// Height of the table top.
const TABLE: f32 = 0.74;
/// Cells a patch and direction.
const STEPS: usize = 14;

pub(super) fn build() -> Scene {
    let mut stage = Stage::new("teapot");
    room(&mut stage);
    table(&mut stage);

    let pot = pot(&mut stage);
    stage.place("teapot", pot, placed(vec3(-0.04, TABLE + 0.006, -0.08), 22.0));
    still_life(&mut stage);

    stage.spot("window", ([1.15, 1.95, 1.25], [-0.06, TABLE, -0.05]), srgb(0xfff0d8), 9.0, (13.0, 27.0));
    stage.spot("room light", ([-0.9, 2.25, 0.9], [0.0, TABLE, -0.2]), srgb(0xd6e2ff), 1.6, (25.0, 55.0));
    let sky = GradientSky {
        zenith: Vec3::new(0.05, 0.055, 0.06),
        horizon: Vec3::new(0.08, 0.08, 0.08),
        ground: Vec3::new(0.04, 0.035, 0.03),
        to_sun: vec3(1.0, 1.0, 1.0),
        glow: Vec3::ZERO,
    };
    stage.scene.environment = Some(sky.environment("room", 64, 32));

    stage.camera("front", [0.08, 1.06, 0.86], [0.0, 0.81, -0.04], 35.0);
    stage.camera("spout", [0.62, 0.98, 0.36], [0.03, 0.815, -0.03], 40.0);
    stage.camera("above", [-0.15, 1.5, 0.55], [-0.01, 0.76, 0.0], 36.0);
    stage.camera("lid", [0.1, 1.09, 0.26], [-0.03, 0.87, -0.08], 44.0);
    stage.finish()
}

/// The teapot as it stands on y = 0, in `steps` × `steps` cells a patch. Seen from both sides.
pub(super) fn shape(steps: usize) -> Geometry {
    patches::tessellate(steps, SCALE)
}

/// The teapot alone.
pub(super) fn pot(stage: &mut Stage) -> u32 {
    let glaze =
        stage.material(Material { double_sided: true, roughness: 0.16, ..Material::diffuse("glaze", srgb(0xe9e4d8)) });
    stage.mesh("teapot", Model::of(glaze, shape(STEPS)))
}

fn room(stage: &mut Stage) {
    let boards = stage.textured("floor boards", &planks(256, 8, srgb(0x9a7850), srgb(0x6d4f31), 3), 1.2, 0.6);
    stage.add("floor", Model::of(boards, sheet(5.0, 5.0, 1, 1).at(0.0, 0.0, 0.6)));
    let plaster = mottled(128, 6, srgb(0xb9573f), srgb(0xa94a35), 0.002, 4);
    let warm = stage.textured("terracotta wall", &plaster, 1.5, 0.9);
    stage.add("back wall", Model::of(warm, wall(5.0, 2.6, 0.1, &[]).at(-2.5, 0.0, -0.62)));
    let cool = stage.textured("teal wall", &mottled(128, 6, srgb(0x4c8f8b), srgb(0x3f807c), 0.002, 5), 1.5, 0.9);
    let window = Opening { left: 1.7, bottom: 0.9, width: 1.1, height: 1.2 };
    stage.add("side wall", Model::of(cool, wall(4.0, 2.6, 0.1, &[window]).turned_y(90.0).at(-1.0, 0.0, 3.0)));
}

fn table(stage: &mut Stage) {
    let oak = stage.textured("oak", &planks(512, 12, srgb(0xb98a56), srgb(0x7d5530), 11), 1.5, 0.45);
    let mut table = Geometry::default();
    table.append(&bevel_box(1.36, 0.036, 0.86, 0.006).at(0.0, TABLE - 0.018, 0.0));
    for (x, z) in [(-0.6, -0.35), (0.6, -0.35), (-0.6, 0.35), (0.6, 0.35)] {
        table.append(&frustum(0.022, 0.034, TABLE - 0.036, 24).at(x, 0.0, z));
    }
    table.append(&slab([-0.58, TABLE - 0.12, -0.365], [0.58, TABLE - 0.037, -0.335]));
    table.append(&slab([-0.58, TABLE - 0.12, 0.335], [0.58, TABLE - 0.037, 0.365]));
    stage.add("table", Model::of(oak, table));
    // A woven runner under the pot: thin, level, with a fringe of its own colour.
    let cloth = stage.textured("linen", &mottled(128, 24, srgb(0x7f93a8), srgb(0x65798f), 0.0006, 21), 0.2, 0.95);
    stage.add("runner", Model::of(cloth, bevel_box(0.92, 0.005, 0.36, 0.0015).at(0.0, TABLE + 0.0026, -0.03)));
}

fn still_life(stage: &mut Stage) {
    let china = stage.material(Material { roughness: 0.2, ..Material::diffuse("china", srgb(0xe6e2da)) });
    let tea = stage.paint("tea", 0x5a2208, 0.08);
    let (cup, saucer) = (cup(), saucer());
    let mut service = Model::default();
    service.add(china, saucer);
    service.add(china, cup.at(0.0, 0.008, 0.0));
    service.add(tea, frustum(0.0375, 0.0375, 0.002, 40).at(0.0, 0.05, 0.0));
    let service = stage.mesh("cup and saucer", service);
    stage.place("near cup", service, placed(vec3(0.2, TABLE, 0.17), -35.0));
    stage.place("far cup", service, placed(vec3(-0.3, TABLE, 0.09), 150.0));

    let steel = stage.metal("steel", 0xc9c7c2, 0.22);
    let spoon = stage.mesh("spoon", Model::of(steel, spoon()));
    stage.place("spoon", spoon, placed(vec3(0.3, TABLE + 0.0035, 0.24), 72.0));

    let peel = stage.textured("orange peel", &mottled(128, 24, srgb(0xe8871e), srgb(0xd9700f), 0.0012, 31), 0.12, 0.45);
    let orange = stage.mesh("orange", Model::of(peel, sphere(0.038, 40, 20)));
    stage.place("orange", orange, Mat4::from_translation(vec3(0.27, TABLE + 0.038, -0.2)));
    let second = at(0.34, TABLE + 0.0372, -0.14) * Mat4::from_rotation_z(1.1) * Mat4::from_scale(Vec3::splat(0.98));
    stage.place("second orange", orange, second);
    let lime = stage.textured("lime peel", &mottled(128, 20, srgb(0x7da33a), srgb(0x5c8a28), 0.001, 32), 0.12, 0.4);
    let fruit = sphere(0.03, 40, 20).transformed(Mat4::from_scale(vec3(1.18, 1.0, 1.0)));
    stage.add("lime", Model::of(lime, fruit.turned_y(25.0).at(0.27, TABLE + 0.035, -0.115)));
}

/// A closed cup of 6 cm with a foot, a wall of 3 mm and a handle towards +X.
fn cup() -> Geometry {
    let profile = [
        (0.0, 0.003),
        (0.021, 0.003),
        (0.022, 0.0),
        (0.025, 0.0),
        (0.026, 0.005),
        (0.036, 0.02),
        (0.0415, 0.042),
        (0.0425, 0.06),
        (0.0418, 0.0612),
        (0.0405, 0.06),
        (0.0385, 0.042),
        (0.033, 0.022),
        (0.023, 0.009),
        (0.0, 0.007),
    ];
    let mut cup = lathe(&profile.map(|(r, y)| vec2(r, y)), 48, 50.0);
    let path: Vec<Vec3> = (0..=20)
        .map(|i| {
            let angle = (-80.0 + 160.0 * i as f32 / 20.0).to_radians();
            vec3(0.039 + 0.021 * angle.cos(), 0.034 + 0.018 * angle.sin(), 0.0)
        })
        .collect();
    let oval: Vec<Vec2> = (0..12).map(|i| Vec2::from_angle(i as f32 / 12.0 * std::f32::consts::TAU)).collect();
    let oval: Vec<Vec2> = oval.iter().map(|p| *p * vec2(0.0038, 0.0028)).collect();
    cup.append(&sweep(&path, &oval, true, |_| 1.0));
    cup
}

fn saucer() -> Geometry {
    let profile = [
        (0.0, 0.003),
        (0.026, 0.003),
        (0.027, 0.0),
        (0.031, 0.0),
        (0.033, 0.004),
        (0.055, 0.008),
        (0.072, 0.015),
        (0.0722, 0.017),
        (0.07, 0.0172),
        (0.054, 0.011),
        (0.032, 0.008),
        (0.0, 0.0075),
    ];
    lathe(&profile.map(|(r, y)| vec2(r, y)), 56, 50.0)
}

/// A teaspoon lying along X with its bowl at the origin.
fn spoon() -> Geometry {
    let bowl = sphere(1.0, 24, 12).displaced(|p| {
        let narrow = 1.0 - 0.25 * p.x;
        let y = p.y * 0.0012 + 0.0045 * (p.x * p.x + p.z * p.z) - 0.002;
        vec3(p.x * 0.021, y, p.z * 0.0145 * narrow)
    });
    let path: Vec<Vec3> = (0..=12)
        .map(|i| {
            let t = i as f32 / 12.0;
            vec3(0.019 + 0.1 * t, 0.003 + 0.007 * (t * 1.9).sin(), 0.0)
        })
        .collect();
    let section: Vec<Vec2> = (0..10).map(|i| Vec2::from_angle(i as f32 / 10.0 * std::f32::consts::TAU)).collect();
    let section: Vec<Vec2> = section.iter().map(|p| *p * vec2(0.0025, 0.0011)).collect();
    let mut out = bowl;
    out.append(&sweep(&path, &section, true, |i| 0.8 + 0.09 * i as f32));
    out
}
