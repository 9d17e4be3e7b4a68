//! Pictures of the path tracer where the light is known exactly.

use crate::tracer_lab::{Stage, deviation, expect_mean, flat_view, luminance, matt, mean, render, view};
use glam::{Mat4, Vec2, Vec3, Vec4, vec3};
use lucerna::{
    gpu::testing::with_gpu,
    scene::{AlphaMode, Environment, LightKind, Material, Texture, TextureRef},
    tracer::{Filter, Settings},
};
use std::f64::consts::PI;

/// Everything, rays through the centres.
fn full(bounces: u32) -> Settings {
    Settings { bounces, specular_bounces: 40, filter: Filter::Centre, ..Settings::default() }
}

fn glass(double_sided: bool) -> Material {
    Material { transmission: 1.0, roughness: 0.0, double_sided, ..Material::diffuse("glass", Vec3::ONE) }
}

#[test]
fn a_closed_box_is_a_geometric_series() {
    with_gpu(|gpu| {
        let mut stage = Stage::new();
        let wall =
            stage.material(Material { emissive: Vec3::splat(0.3), ..Material::diffuse("wall", Vec3::splat(0.5)) });
        stage.cuboid(wall, Vec3::splat(-1.0), Vec3::splat(1.0), true);
        let seen = view(vec3(0.3, 0.2, 0.4), vec3(-1.0, -0.6, -0.9), 70.0, [16, 16]);
        // The wall shows its own 0.3; each scattering adds ρ times as much.
        for (bounces, samples) in [(0, 32), (1, 32), (3, 32), (40, 48)] {
            let layers = render(gpu, &stage.scene, &seen, &matt(bounces), samples);
            expect_mean(&layers, 0.3 * (1.0 - 0.5f64.powi(bounces as i32 + 2)) / 0.5, 1e-5);
            assert!((mean(&layers, "emission")[0] - 0.3).abs() < 1e-6);
            assert!((mean(&layers, "direct")[1] - 0.15).abs() < 0.003, "{:?}", mean(&layers, "direct"));
        }
    });
}

#[test]
fn a_lamp_in_the_middle_of_a_sphere() {
    with_gpu(|gpu| {
        // Pharr, Humphreys: albedo 1/2, intensity π, radius 1: radiance 1/2 + 1/4 + … = 1.
        let mut stage = Stage::new();
        let wall = stage.material(Material::diffuse("wall", Vec3::splat(0.5)));
        stage.sphere(wall, Vec3::ZERO, 1.0, 40, true);
        stage.point(Vec3::ZERO, Vec3::splat(PI as f32));
        let seen = view(vec3(0.1, 0.2, 0.0), vec3(1.0, 0.4, 0.3), 80.0, [16, 16]);
        let layers = render(gpu, &stage.scene, &seen, &matt(60), 48);
        expect_mean(&layers, 1.0, 0.006);
        assert!((mean(&layers, "direct")[0] - 0.5).abs() < 0.003);
        let one = render(gpu, &stage.scene, &seen, &matt(1), 16);
        expect_mean(&one, 0.75, 0.006);
    });
}

#[test]
fn nothing_is_lost_in_a_white_furnace() {
    with_gpu(|gpu| {
        // A ball in a corner of two walls, all white, under a white sky.
        let mut stage = Stage::new();
        let white = stage.material(Material { double_sided: true, ..Material::diffuse("white", Vec3::ONE) });
        stage.quad(white, vec3(-1.0, 0.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0);
        stage.quad(white, vec3(-1.0, 0.0, -1.0), Vec3::X * 2.0, Vec3::Y * 2.0);
        stage.sphere(white, vec3(0.0, 0.4, 0.0), 0.4, 12, false);
        stage.scene.environment = Some(Environment::constant(Vec3::splat(0.7)));
        let seen = view(vec3(2.0, 1.5, 3.0), vec3(0.0, 0.4, 0.0), 40.0, [24, 24]);
        let layers = render(gpu, &stage.scene, &seen, &Settings { roulette: 60, ..matt(200) }, 24);
        expect_mean(&layers, 0.7, 1e-4);
    });
}

#[test]
fn squares_and_discs_see_each_other_by_their_form_factors() {
    with_gpu(|gpu| {
        // Parallel unit squares at distance 1 (Howell, C-11): 0.19982.
        let mut stage = Stage::new();
        let (floor, lamp) =
            (stage.material(Material::diffuse("floor", Vec3::splat(0.5))), stage.emitter(Vec3::splat(3.0)));
        stage.quad(floor, Vec3::ZERO, Vec3::Z, Vec3::X);
        stage.quad(lamp, Vec3::Y, Vec3::X, Vec3::Z);
        let above = flat_view(vec3(0.5, 0.5, 0.5), vec3(0.5, 0.0, 0.5), 1.0, [16, 16]);
        let x: f64 = 1.0;
        let (a, b) = (1.0 + x * x, (1.0 + 2.0 * x * x).ln());
        let square = 2.0 / (PI * x * x)
            * ((a * a).ln() / 2.0 - b / 2.0 + 2.0 * x * a.sqrt() * (x / a.sqrt()).atan() - 2.0 * x * x.atan());
        assert!((square - 0.199_825).abs() < 1e-5);
        let jittered = Settings { filter: Filter::Box, ..matt(0) };
        expect_mean(&render(gpu, &stage.scene, &above, &jittered, 192), 0.5 * 3.0 * square, 1e-4);

        // Coaxial unit discs at distance 1 (C-41): (3 - √5) / 2.
        let mut stage = Stage::new();
        let (floor, lamp) =
            (stage.material(Material::diffuse("floor", Vec3::splat(0.5))), stage.emitter(Vec3::splat(3.0)));
        const N: u32 = 96;
        for (material, y, normal) in [(floor, 0.0, Vec3::Y), (lamp, 1.0, Vec3::NEG_Y)] {
            let angle = |i: u32| 2.0 * std::f32::consts::PI * i as f32 / N as f32;
            let rim = (0..N).map(|i| vec3(angle(i).sin(), y, angle(i).cos()));
            let positions: Vec<Vec3> = std::iter::once(vec3(0.0, y, 0.0)).chain(rim).collect();
            let around = |i: u32| [0, 1 + i, 1 + (i + 1) % N];
            let turned = |[a, b, c]: [u32; 3]| if normal.y > 0.0 { [a, b, c] } else { [a, c, b] };
            let indices = (0..N).flat_map(|i| turned(around(i))).collect();
            stage.mesh(material, positions, vec![normal; N as usize + 1], indices);
        }
        let above = flat_view(vec3(0.0, 0.5, 0.0), Vec3::ZERO, 2.0, [16, 16]);
        // The disc fills π/4 of the picture.
        let disc = (3.0 - 5.0f64.sqrt()) / 2.0 * PI / 4.0;
        expect_mean(&render(gpu, &stage.scene, &above, &jittered, 192), 0.5 * 3.0 * disc, 3e-3);
    });
}

#[test]
fn irradiance_of_a_ball_and_of_a_patch_of_sky() {
    with_gpu(|gpu| {
        // A ball of radius r at distance d over a plane that faces it: E = π L (r/d)².
        let mut stage = Stage::new();
        let (floor, lamp) = (stage.material(Material::diffuse("floor", Vec3::ONE)), stage.emitter(Vec3::splat(5.0)));
        stage.quad(floor, vec3(-0.01, 0.0, -0.01), Vec3::Z * 0.02, Vec3::X * 0.02);
        stage.sphere(lamp, vec3(0.0, 2.0, 0.0), 0.5, 48, false);
        let above = flat_view(vec3(0.0, 0.5, 0.0), Vec3::ZERO, 0.01, [8, 8]);
        expect_mean(&render(gpu, &stage.scene, &above, &matt(0), 512), 5.0 / 16.0, 4e-3);

        // Sky of radiance 2 within 30° of the zenith: E = π L sin² 30°.
        let mut stage = Stage::new();
        let floor = stage.material(Material::diffuse("floor", Vec3::ONE));
        stage.quad(floor, vec3(-0.01, 0.0, -0.01), Vec3::Z * 0.02, Vec3::X * 0.02);
        let pixels = (0..360 * 180).map(|i| Vec3::splat(if i / 360 < 30 { 2.0 } else { 0.0 })).collect();
        let sky = Environment { width: 360, height: 180, pixels, ..Environment::constant(Vec3::ONE) };
        stage.scene.environment = Some(sky);
        expect_mean(&render(gpu, &stage.scene, &above, &matt(0), 64), 2.0 * 0.25, 1e-3);
    });
}

#[test]
fn punctual_lights_by_the_inverse_square_and_their_cones() {
    with_gpu(|gpu| {
        let place = vec3(0.6, 1.5, -0.4);
        let down = Mat4::from_rotation_translation(glam::Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2), place);
        let (inner, outer) = (0.2f32, 0.9f32);
        let kinds = [
            (LightKind::Point { range: None }, Mat4::from_translation(place)),
            (LightKind::Point { range: Some(2.5) }, Mat4::from_translation(place)),
            (LightKind::Spot { range: None, inner, outer }, down),
            (LightKind::Directional, down),
        ];
        for (index, (kind, world)) in kinds.into_iter().enumerate() {
            let mut stage = Stage::new();
            let floor = stage.material(Material::diffuse("floor", Vec3::splat(0.5)));
            stage.quad(floor, vec3(-1.0, 0.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0);
            stage.light(kind, Vec3::ONE, 4.0, world);
            // One pixel around the origin.
            let above = flat_view(vec3(0.0, 3.0, 0.0), Vec3::ZERO, 1e-3, [1, 1]);
            let found = mean(&render(gpu, &stage.scene, &above, &matt(0), 2), "direct")[1];
            let (r2, cosine) = (f64::from(place.length_squared()), f64::from(place.y / place.length()));
            let shape = match index {
                1 => 1.0 - (r2.sqrt() / 2.5).powi(4),
                2 => {
                    let (i, o) = (f64::from(inner.cos()), f64::from(outer.cos()));
                    ((cosine - o) / (i - o)).clamp(0.0, 1.0).powi(2)
                }
                _ => 1.0,
            };
            let exact = if index == 3 { 4.0 } else { 4.0 * shape * cosine / r2 } * 0.5 / PI;
            assert!((found - exact).abs() < 1e-4 * exact, "light {index}: {found} instead of {exact}");
        }
    });
}

#[test]
fn mirrors_and_panes_by_fresnel() {
    with_gpu(|gpu| {
        let lamp_behind = |stage: &mut Stage| {
            let lamp = stage.emitter(Vec3::splat(2.0));
            stage.quad(lamp, vec3(-5.0, 0.0, -5.0), Vec3::Z * 10.0, Vec3::X * 10.0);
        };
        let above = flat_view(vec3(0.0, 3.0, 0.0), Vec3::ZERO, 0.5, [16, 16]);
        // F at normal incidence 0.04; through both faces with all reflections between them (1 - F) / (1 + F).
        let through = 0.96 / 1.04;
        for thin in [false, true] {
            let mut stage = Stage::new();
            lamp_behind(&mut stage);
            let pane = stage.material(glass(thin));
            if thin {
                stage.quad(pane, vec3(-1.0, 1.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0);
            } else {
                stage.cuboid(pane, vec3(-1.0, 1.0, -1.0), vec3(1.0, 1.3, 1.0), false);
            }
            let layers = render(gpu, &stage.scene, &above, &full(0), 64);
            // All or nothing: the spread is that of a coin.
            let found = mean(&layers, "emission")[0] / 2.0;
            let sigma = (through * (1.0 - through) / (256.0 * 64.0f64)).sqrt();
            assert!((found - through).abs() < 4.5 * sigma, "thin {thin}: {found} instead of {through} ± {sigma}");
        }
        // A lamp inside of the glass: what leaves is thinner by the square of the index, and less by what is reflected.
        let mut stage = Stage::new();
        lamp_behind(&mut stage);
        let pane = stage.material(glass(false));
        stage.quad(pane, vec3(-1.0, 1.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0);
        let found = mean(&render(gpu, &stage.scene, &above, &full(0), 64), "emission")[0] / 2.0 * 2.25;
        let sigma = (0.96 * 0.04 / (256.0 * 64.0f64)).sqrt();
        assert!((found - 0.96).abs() < 4.5 * sigma, "{found} instead of 0.96 ± {sigma}");
        // A mirror at 45° shows a lamp at the side.
        let aside = |material: Material| {
            let mut stage = Stage::new();
            let material = stage.material(material);
            let lamp = stage.emitter(Vec3::splat(2.0));
            stage.quad(material, vec3(-1.0, -1.0, -1.0), Vec3::Z * 2.0, vec3(2.0, 2.0, 0.0));
            stage.quad(lamp, vec3(-3.0, -5.0, -5.0), Vec3::Y * 10.0, Vec3::Z * 10.0);
            stage.scene
        };
        let metal = Material { metallic: 1.0, roughness: 0.0, ..Material::diffuse("mirror", vec3(0.8, 0.5, 0.2)) };
        let layers = render(gpu, &aside(metal), &above, &full(0), 2);
        let graze = (1.0 - 0.5f64.sqrt()).powi(5);
        for (found, f0) in mean(&layers, "emission").into_iter().zip([0.8, 0.5, 0.2]) {
            let exact = 2.0 * (f0 + (1.0 - f0) * graze);
            assert!((found - exact).abs() < 1e-5, "{found} instead of {exact}");
        }
        // As the front of a body of glass does: the mean of both polarisations by Fresnel's equations, 5.02 % at 45°.
        let (cosine, through) = (0.5f64.sqrt(), (1.0 - 0.5 / 2.25f64).sqrt());
        let s = (cosine - 1.5 * through) / (cosine + 1.5 * through);
        let p = (1.5 * cosine - through) / (1.5 * cosine + through);
        let exact = 0.5 * (s * s + p * p);
        let found = mean(&render(gpu, &aside(glass(false)), &above, &full(0), 64), "emission")[0] / 2.0;
        let sigma = (exact * (1.0 - exact) / (256.0 * 64.0f64)).sqrt();
        assert!((found - exact).abs() < 4.5 * sigma, "{found} instead of {exact} ± {sigma}");
    });
}

#[test]
fn a_glass_ball_in_a_furnace_is_not_to_be_seen() {
    with_gpu(|gpu| {
        let mut stage = Stage::new();
        let ball = stage.material(glass(false));
        stage.sphere(ball, Vec3::ZERO, 1.0, 24, false);
        stage.scene.environment = Some(Environment::constant(Vec3::splat(0.9)));
        let seen = view(vec3(0.0, 0.5, 4.0), Vec3::ZERO, 40.0, [24, 24]);
        let settings = Settings { specular_bounces: 200, ..full(2) };
        let layers = render(gpu, &stage.scene, &seen, &settings, 8);
        // Without chance: each path carries the whole radiance, whichever way it goes.
        let picture = &layers.layer("").unwrap().data;
        let off = picture.iter().filter(|&&v| (v - 0.9).abs() > 1e-3).count();
        assert!(off * 100 < picture.len(), "{off} of {} values differ", picture.len());
    });
}

#[test]
fn alpha_cuts_out_and_covers_in_part() {
    with_gpu(|gpu| {
        let above = flat_view(vec3(0.0, 3.0, 0.0), Vec3::ZERO, 0.5, [16, 16]);
        let through = |alpha: AlphaMode, color: Vec4, texture: Option<Texture>| {
            let mut stage = Stage::new();
            let lamp = stage.emitter(Vec3::splat(2.0));
            stage.quad(lamp, vec3(-5.0, 0.0, -5.0), Vec3::Z * 10.0, Vec3::X * 10.0);
            let mut screen = Material { alpha, base_color: color, ..Material::diffuse("screen", Vec3::ZERO) };
            screen.base_color_texture = texture.is_some().then(|| TextureRef::new(0));
            stage.scene.textures.extend(texture);
            let screen = stage.material(screen);
            let node = stage.quad(screen, vec3(-1.0, 1.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0);
            let mesh = stage.scene.nodes[node].mesh.unwrap() as usize;
            stage.scene.meshes[mesh].primitives[0].uvs = vec![vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y]];
            let layers = render(gpu, &stage.scene, &above, &Settings { filter: Filter::Box, ..full(0) }, 64);
            (mean(&layers, "emission")[0] / 2.0, deviation(&layers))
        };
        let mask = AlphaMode::Mask { cutoff: 0.5 };
        assert_eq!(through(mask, Vec4::new(1.0, 1.0, 1.0, 0.4), None).0, 1.0);
        assert_eq!(through(mask, Vec4::new(1.0, 1.0, 1.0, 0.6), None).0, 0.0);
        let (blended, sigma) = through(AlphaMode::Blend, Vec4::new(1.0, 1.0, 1.0, 0.25), None);
        assert!((blended - 0.75).abs() < 4.5 * sigma, "{blended} ± {sigma}");
        // Half of the texels are there; nearest filtering would make it exact, linear filtering keeps the mean.
        let rgba = (0..64).map(|i| [255, 255, 255, if (i / 8 + i) % 2 == 0 { 255 } else { 0 }]).collect();
        let checks = Texture { name: "checks".into(), width: 8, height: 8, rgba };
        let (half, _) = through(mask, Vec4::ONE, Some(checks));
        assert!((half - 0.5).abs() < 0.06, "{half}");
    });
}

#[test]
fn what_one_surface_sends_to_another_is_what_comes_back() {
    with_gpu(|gpu| {
        // A small and a large square with a pillar between them: A₁ F₁₂ = A₂ F₂₁.
        let exchange = |up: bool| {
            let mut stage = Stage::new();
            let (matt_white, lamp) = (stage.material(Material::diffuse("white", Vec3::ONE)), stage.emitter(Vec3::ONE));
            let (low, high) = if up { (lamp, matt_white) } else { (matt_white, lamp) };
            stage.quad(low, vec3(-0.5, 0.0, -0.5), Vec3::Z, Vec3::X);
            stage.quad(high, vec3(-0.8, 1.0, -1.0), Vec3::X * 2.0, Vec3::Z * 2.0);
            let black = stage.material(Material::diffuse("black", Vec3::ZERO));
            stage.cuboid(black, vec3(-0.2, 0.45, -0.3), vec3(0.3, 0.55, 0.1), false);
            // Cameras between pillar and square, looking at the square that receives.
            let seen = if up {
                flat_view(vec3(0.2, 0.9, 0.0), vec3(0.2, 1.0, 0.0), 2.0, [16, 16])
            } else {
                flat_view(vec3(0.0, 0.1, 0.0), Vec3::ZERO, 1.0, [16, 16])
            };
            let layers = render(gpu, &stage.scene, &seen, &Settings { filter: Filter::Box, ..matt(0) }, 256);
            let area = if up { 4.0 } else { 1.0 };
            (luminance(mean(&layers, "direct")) * area, deviation(&layers) * area)
        };
        let ((a, sa), (b, sb)) = (exchange(true), exchange(false));
        assert!(a > 0.05 && (a - b).abs() < 4.5 * (sa * sa + sb * sb).sqrt(), "{a} ± {sa}, {b} ± {sb}");
    });
}
