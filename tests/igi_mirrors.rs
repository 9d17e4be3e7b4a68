//! Mirrors and glass of instant global illumination against the path tracer.

use crate::igi_lab::{Studio, flux, mean, plain, room};
use crate::tracer_lab::{Stage, flat_view, render, view};
use glam::{Mat4, Quat, Vec3, vec3};
use lucerna::{
    gpu::testing::with_gpu,
    scene::{AlphaMode, LightKind, Material},
    techniques::igi::Settings,
    tracer::{Filter, Settings as Tracing},
};

/// A material without gloss: with a refractive index of 1, F0 is 0.
fn matt(albedo: Vec3) -> Material {
    Material { ior: 1.0, ..Material::diffuse("matt", albedo) }
}

fn mirror() -> Material {
    Material { metallic: 1.0, roughness: 0.0, ..Material::diffuse("mirror", vec3(0.9, 0.8, 0.7)) }
}

fn glass(double_sided: bool) -> Material {
    Material { transmission: 1.0, roughness: 0.0, double_sided, ..Material::diffuse("glass", vec3(0.9, 1.0, 0.95)) }
}

fn blocks(pixels: impl Iterator<Item = f64> + Clone, width: usize, side: usize) -> Vec<f64> {
    let mut sums = vec![0.0; (width / side).pow(2)];
    for (i, value) in pixels.enumerate() {
        sums[i / width / side * (width / side) + i % width / side] += value / (side * side) as f64;
    }
    sums
}

#[test]
fn mirrors_and_glass_show_what_the_path_tracer_shows() {
    with_gpu(|gpu| {
        // Direct light only, seen in mirrors that reflect each other, through a glass ball and through a pane.
        let mut stage = Stage::new();
        let (red, white) = (stage.material(matt(vec3(0.8, 0.2, 0.1))), stage.material(matt(Vec3::splat(0.7))));
        let (shine, pane, ball) = (stage.material(mirror()), stage.material(glass(true)), stage.material(glass(false)));
        stage.quad(white, vec3(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0);
        stage.quad(red, vec3(-2.0, 0.0, -2.0), Vec3::X * 4.0, Vec3::Y * 2.0);
        stage.quad(shine, vec3(-1.2, 0.0, 1.0), Vec3::Z * -2.6, Vec3::Y * 1.5);
        stage.quad(shine, vec3(1.5, 0.0, -1.6), Vec3::Z * 2.6, Vec3::Y * 1.5);
        stage.quad(pane, vec3(0.3, 0.1, 0.2), Vec3::X * 0.9, Vec3::Y * 0.9);
        stage.sphere(ball, vec3(-0.3, 0.45, -0.3), 0.4, 24, false);
        stage.point(vec3(0.4, 1.9, 1.2), Vec3::splat(6.0));
        const SIDE: usize = 40;
        let seen = view(vec3(0.3, 0.9, 2.6), vec3(0.0, 0.5, 0.0), 50.0, [SIDE as u32; 2]);
        let truth = Tracing { bounces: 0, specular_bounces: 8, filter: Filter::Centre, ..Tracing::default() };
        let expected = render(gpu, &stage.scene, &seen, &truth, 96);
        let picture = &expected.layer("").unwrap().data;
        let settings = Settings { indirect: false, specular_depth: 8, direct_samples: 32, ..Settings::default() };
        let mut studio = Studio::new(gpu, &stage.scene);
        let mut sum = vec![0.0; SIDE * SIDE];
        // Ray trees with too few nodes choose branches at random.
        for seed in 0..8 {
            let shown = studio.render(&seen, &settings, seed);
            sum.iter_mut().zip(&shown.total).for_each(|(sum, p)| *sum += f64::from(p[0] + p[1] + p[2]) / 8.0);
        }
        let found = blocks(sum.iter().copied(), SIDE, 8);
        let theirs = blocks(picture.chunks_exact(3).map(|p| f64::from(p[0] + p[1] + p[2])), SIDE, 8);
        for (i, (found, expected)) in found.iter().zip(&theirs).enumerate() {
            println!("block {i}: {found:.4} and {expected:.4}");
            assert!((found - expected).abs() < 0.04 * expected + 0.004, "block {i}: {found} instead of {expected}");
        }
    });
}

#[test]
fn a_mirror_shows_indirect_light() {
    with_gpu(|gpu| {
        // A wall that only virtual lights reach, seen directly and in a mirror of reflectance 1.
        let mut stage = Stage::new();
        let white = stage.material(matt(Vec3::splat(0.8)));
        let shine =
            stage.material(Material { metallic: 1.0, roughness: 0.0, ..Material::diffuse("mirror", Vec3::ONE) });
        stage.cuboid(white, Vec3::splat(-1.0), Vec3::ONE, true);
        stage.point(vec3(0.0, 0.0, 0.9), Vec3::ONE);
        let settings = Settings { vpls: 64, candidates: 1, bounces: 1, bound: 0.05, ..Settings::default() };
        let direct = view(vec3(0.0, 0.0, 0.3), vec3(-1.0, 0.0, -0.7), 20.0, [16, 16]);
        let plain = Studio::new(gpu, &stage.scene).render(&direct, &settings, 0);
        // The mirror does not occlude the wall, and reflects the view by its normal.
        stage.quad(shine, vec3(0.5, -0.02, -0.02), Vec3::Z * 0.04, Vec3::Y * 0.04);
        let (at, towards) = (vec3(0.0, 0.0, 0.3), vec3(0.5, 0.0, 0.0));
        let mirrored = view(at, towards, 1.0, [16, 16]);
        let shown = Studio::new(gpu, &stage.scene).render(&mirrored, &settings, 0);
        assert!(mean(&shown.indirect) == 0.0, "a mirror has no diffuse part");
        // The same point of the wall, where the reflected ray reaches x = -1.
        let reflected = vec3(-0.5, 0.0, -0.3);
        let wall = towards + reflected * 3.0;
        let same = view(vec3(0.3, 0.0, -0.12), wall, 1.0, [16, 16]);
        let plain_there = Studio::new(gpu, &stage.scene).render(&same, &settings, 0);
        let (a, b) = (mean(&shown.total), mean(&plain_there.total));
        println!("in the mirror {a}, directly {b} (indirect {})", mean(&plain_there.indirect));
        assert!((a / b - 1.0).abs() < 0.03, "in the mirror {a}, directly {b}");
        assert!(mean(&plain.total) > 0.0 && mean(&plain_there.indirect) > 0.05 * b);
    });
}

#[test]
fn what_of_glass_is_blended_away_shows_what_lies_behind_it() {
    with_gpu(|gpu| {
        // A pane in front of an emissive wall, lit from the front. A diffuse part of the pane, which glass must not have, would be bright.
        let alpha = 0.4f32;
        let picture = |pane: Option<AlphaMode>| {
            let mut stage = Stage::new();
            let glow = stage.emitter(vec3(0.8, 0.5, 0.3));
            stage.quad(glow, vec3(-2.0, -2.0, -1.0), 4.0 * Vec3::X, 4.0 * Vec3::Y);
            if let Some(mode) = pane {
                let tinted = Material { alpha: mode, ..glass(true) };
                let base_color = tinted.base_color.truncate().extend(alpha);
                let tinted = stage.material(Material { base_color, ..tinted });
                stage.quad(tinted, vec3(-2.0, -2.0, 0.0), 4.0 * Vec3::X, 4.0 * Vec3::Y);
            }
            stage.point(vec3(0.0, 0.0, 1.5), Vec3::splat(30.0));
            let seen = flat_view(vec3(0.0, 0.0, 2.0), Vec3::ZERO, 2.0, [96, 96]);
            let settings = Settings { indirect: false, ..Settings::default() };
            mean(&Studio::new(gpu, &stage.scene).render(&seen, &settings, 0).total)
        };
        let (whole, none) = (picture(Some(AlphaMode::Opaque)), picture(None));
        let found = picture(Some(AlphaMode::Blend));
        let expected = f64::from(alpha) * whole + f64::from(1.0 - alpha) * none;
        println!("pane {whole:.4}, none {none:.4}, blended {found:.4} instead of {expected:.4}");
        assert!(whole < 0.95 * none && (found / expected - 1.0).abs() < 0.01, "{found} instead of {expected}");
    });
}

#[test]
fn holes_close_to_a_mirror_show_what_it_shows() {
    with_gpu(|gpu| {
        // An emissive wall behind the camera, seen in a mirror with a sheet a twentieth of a millimetre in front of it.
        let picture = |sheet: Option<(AlphaMode, f32)>| {
            let mut stage = Stage::new();
            let glow = stage.emitter(vec3(0.8, 0.5, 0.3));
            stage.quad(glow, vec3(4.0, -4.0, 4.0), -8.0 * Vec3::X, 8.0 * Vec3::Y);
            let shiny = stage.material(mirror());
            stage.quad(shiny, vec3(-2.0, -2.0, 0.0), 4.0 * Vec3::X, 4.0 * Vec3::Y);
            if let Some((mode, alpha)) = sheet {
                let base_color = Vec3::ZERO.extend(alpha);
                let black = stage.material(Material { alpha: mode, base_color, ..matt(Vec3::ZERO) });
                stage.quad(black, vec3(-2.0, -2.0, 5e-5), 4.0 * Vec3::X, 4.0 * Vec3::Y);
            }
            let seen = flat_view(vec3(0.0, 0.0, 2.0), Vec3::ZERO, 2.0, [96, 96]);
            let settings = Settings { indirect: false, ..Settings::default() };
            mean(&Studio::new(gpu, &stage.scene).render(&seen, &settings, 0).total)
        };
        let whole = picture(None);
        let cut = picture(Some((AlphaMode::Mask { cutoff: 0.5 }, 0.2)));
        let left = picture(Some((AlphaMode::Mask { cutoff: 0.5 }, 0.8)));
        let clear = picture(Some((AlphaMode::Blend, 0.0)));
        println!("mirror {whole:.4}; behind a hole {cut:.4}, a sheet {left:.4}, nothing {clear:.4}");
        assert!(whole > 0.3 && cut == whole && clear == whole && left < 0.01 * whole);
    });
}

#[test]
fn light_passes_as_many_panes_as_it_may() {
    with_gpu(|gpu| {
        // Boxes of clear sheets around a lamp, one in the other, that bend and reflect nothing.
        let mut stage = room(Vec3::splat(0.5));
        let clear = Material { ior: 1.0, base_color: Vec3::ONE.extend(1.0), ..glass(true) };
        let clear = stage.material(clear);
        for half in [0.2, 0.3, 0.4] {
            stage.cuboid(clear, Vec3::splat(-half), Vec3::splat(half), false);
        }
        stage.point(vec3(0.01, 0.02, -0.03), Vec3::splat(2.0));
        let mut studio = Studio::new(gpu, &stage.scene);
        let seen = view(vec3(0.0, 0.0, 0.9), vec3(0.3, 0.2, 1.0), 60.0, [4, 4]);
        let exact = 0.5 * 8.0 * std::f32::consts::PI;
        for (specular_depth, share) in [(2, 0.0), (3, 1.0), (4, 1.0)] {
            let settings = Settings { specular: true, specular_depth, ..plain(600) };
            let found = flux(&studio.render(&seen, &settings, 0).vpls, 0).x / exact;
            println!("{specular_depth} panes: {found} of the flux");
            assert!((found - share).abs() < 1e-3, "{specular_depth} panes: {found} of the flux");
        }
    });
}

#[test]
fn a_surface_that_is_glass_in_part_reflects_by_the_rest() {
    with_gpu(|gpu| {
        // A wall before nothing, lit by a lamp and by the floor: of what it reflects the glass takes its share, and shows black.
        let shown = |transmission: f32| {
            let mut stage = Stage::new();
            let floor = stage.material(matt(vec3(0.8, 0.6, 0.4)));
            let wall = stage.material(Material { transmission, double_sided: true, ..matt(vec3(0.7, 0.5, 0.9)) });
            stage.quad(floor, vec3(-1.0, 0.0, 0.0), Vec3::Z * 2.0, Vec3::X * 2.0);
            stage.quad(wall, vec3(-1.0, 0.0, 0.0), Vec3::X * 2.0, Vec3::Y * 2.0);
            stage.point(vec3(0.2, 1.0, 1.0), Vec3::splat(3.0));
            let seen = flat_view(vec3(0.0, 1.0, 3.0), vec3(0.0, 1.0, 0.0), 1.8, [24, 24]);
            let settings = Settings { specular: true, direct_samples: 1, ..plain(200) };
            let shown = Studio::new(gpu, &stage.scene).render(&seen, &settings, 0);
            [mean(&shown.direct), mean(&shown.indirect), mean(&shown.total)]
        };
        let whole = shown(0.0);
        assert!(whole[1] > 0.05 * whole[2], "{whole:?}");
        for transmission in [0.25f32, 0.75, 1.0] {
            let found = shown(transmission);
            println!("{transmission} glass: direct, indirect, total {found:?} of {whole:?}");
            for (found, whole) in found.into_iter().zip(whole) {
                let expected = f64::from(1.0 - transmission) * whole;
                assert!((found - expected).abs() < 2e-3 * whole, "{transmission}: {found} instead of {expected}");
            }
        }
    });
}

/// Share of light that a smooth surface of index 1.5 reflects at this cosine.
fn fresnel(cosine: f64) -> f64 {
    let inside = (1.0 - (1.0 - cosine * cosine) / 2.25).sqrt();
    let [s, p] = [(cosine - 1.5 * inside) / (cosine + 1.5 * inside), (1.5 * cosine - inside) / (1.5 * cosine + inside)];
    0.5 * (s * s + p * p)
}

#[test]
fn a_narrow_beam_is_divided_as_by_fresnel_and_takes_the_tint_of_what_it_passes() {
    with_gpu(|gpu| {
        let (tint, outer) = (vec3(0.9, 0.6, 0.3), 0.05f32);
        let sheet = Material { base_color: tint.extend(1.0), ..glass(true) };
        let metal = Material { base_color: tint.extend(1.0), double_sided: true, ..mirror() };
        let in_half = Material { transmission: 0.5, ior: 1.0, ..metal.clone() };
        for cosine in [0.25f32, 0.5, 0.95] {
            let f = fresnel(cosine.into());
            let reflects = 2.0 * f / (1.0 + f);
            let metallic = tint + (1.0 - tint) * (1.0 - cosine).powi(5);
            for (name, matter, back, through) in [
                ("sheet", &sheet, Vec3::splat(reflects as f32), tint * (1.0 - reflects) as f32),
                ("mirror", &metal, metallic, Vec3::ZERO),
                // With an index of 1 the half that is glass passes all light.
                ("half a mirror", &in_half, 0.5 * metallic, 0.5 * tint),
            ] {
                let mut stage = room(Vec3::splat(0.5));
                let matter = stage.material(matter.clone());
                stage.quad(matter, vec3(-1.0, -1.0, 0.0), 2.0 * Vec3::X, 2.0 * Vec3::Y);
                // A beam that meets the middle of the plane z = 0.
                let along = vec3(0.0, (1.0 - cosine * cosine).sqrt(), -cosine);
                let lamp = Mat4::from_rotation_translation(Quat::from_rotation_arc(Vec3::NEG_Z, along), -0.5 * along);
                stage.light(LightKind::Spot { range: None, inner: 0.0, outer }, Vec3::ONE, 1e4, lamp);
                let seen = view(vec3(0.0, 0.0, 0.9), vec3(0.3, 0.2, 1.0), 60.0, [2, 2]);
                let settings = Settings { specular: true, specular_depth: 1, ..plain(10000) };
                let vpls = Studio::new(gpu, &stage.scene).render(&seen, &settings, 0).vpls;
                let side = |front: bool| {
                    let there: Vec<_> = vpls.iter().filter(|v| (v.position[2] > 0.0) == front).copied().collect();
                    flux(&there, 0)
                };
                let sent = 0.5 * 1e4 * 2.0 * std::f32::consts::PI * (1.0 - outer.cos()) / 3.0;
                let found = [side(true) / sent, side(false) / sent];
                println!("{name}, cosine {cosine}: back {} of {back}, through {} of {through}", found[0], found[1]);
                for (found, exact) in found.into_iter().zip([back, through]) {
                    assert!(
                        (found - exact).abs().max_element() < 0.012,
                        "{name}, cosine {cosine}: {found} not {exact}"
                    );
                }
            }
        }
    });
}

#[test]
fn a_rough_metal_keeps_its_highlight_beside_a_mirror() {
    with_gpu(|gpu| {
        // The mirror lies out of the picture and out of the light.
        let shown = |beside: bool| {
            let mut stage = Stage::new();
            let rough = Material { metallic: 1.0, roughness: 0.3, ..Material::diffuse("metal", vec3(0.9, 0.8, 0.7)) };
            let (rough, smooth) = (stage.material(rough), stage.material(mirror()));
            stage.quad(rough, vec3(-1.0, 0.0, -1.0), 2.0 * Vec3::Z, 2.0 * Vec3::X);
            if beside {
                stage.quad(smooth, vec3(4.0, 0.0, -1.0), 2.0 * Vec3::Z, 2.0 * Vec3::X);
            }
            stage.point(vec3(0.2, 1.0, -0.1), Vec3::splat(3.0));
            let seen = flat_view(vec3(0.0, 2.0, 0.4), Vec3::ZERO, 0.8, [24, 24]);
            let settings = Settings { indirect: false, ..Settings::default() };
            mean(&Studio::new(gpu, &stage.scene).render(&seen, &settings, 0).total)
        };
        let (alone, beside) = (shown(false), shown(true));
        println!("highlight {alone:.4}, beside a mirror {beside:.4}");
        assert!(alone > 0.1 && (beside / alone - 1.0).abs() < 1e-3, "{beside} instead of {alone}");
    });
}
