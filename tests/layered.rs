//! Gloss over a matt base in every technique: absolute radiance at the angle of the mirror, and what is reflected of light from
//! everywhere, against closed forms, the integrals of `reference::brdf`, and the path tracer.

use crate::fiv_lab;
use crate::igi_lab;
use crate::isr_lab;
use crate::tracer_lab::{Stage, deviation, flat_view, mean, render};
use glam::{DVec3, Mat4, Vec3, vec3};
use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    graph::{Extent, Graph},
    image::srgb,
    passes::direct::{self, Direct},
    reference::{brdf::Matter, isr_scene::Buffers},
    scene::{Environment, LightKind, Material, Pose, Scene, View},
    shaders::{consts, types},
    techniques::{fiv, igi},
    tracer::{Filter, Settings as Tracing},
};
use std::f64::consts::PI;

/// Angles of the viewer to the normal, degrees. The last two are those under which gloss added to Lambert's law made light.
const ANGLES: [f64; 3] = [0.0, 53.0, 78.0];

/// The step of values that eight bits hold.
const EIGHTH: f64 = 1.0 / 255.0;

/// Albedo, reflectance at normal incidence, roughness; numbers that eight bits hold.
fn matters() -> Vec<Matter> {
    let grey = |albedo: f64, f0: f64, roughness: f64| Matter {
        albedo: DVec3::splat(albedo),
        f0: DVec3::splat(f0 * EIGHTH),
        roughness: roughness * EIGHTH,
    };
    vec![
        grey(1.0, 10.0, 51.0),
        grey(1.0, 10.0, 128.0),
        grey(1.0, 10.0, 255.0),
        grey(0.0, 10.0, 102.0),
        grey(0.0, 255.0, 102.0),
        grey(0.0, 255.0, 255.0),
        Matter {
            albedo: DVec3::from_array([231, 149, 89].map(|code| srgb::decode_u8(code).into())),
            ..grey(0.0, 10.0, 153.0)
        },
        Matter { f0: DVec3::new(255.0, 204.0, 51.0) * EIGHTH, ..grey(0.0, 0.0, 153.0) },
    ]
}

fn material(matter: &Matter) -> Material {
    // A dielectric by its index, or a metal.
    let metal = matter.f0.max_element() > 0.2;
    let root = matter.f0.x.sqrt();
    let base = if metal { matter.f0 } else { matter.albedo };
    Material {
        roughness: matter.roughness as f32,
        metallic: f32::from(u8::from(metal)),
        ior: if metal { 1.5 } else { ((1.0 + root) / (1.0 - root)) as f32 },
        ..Material::diffuse("plate", base.as_vec3())
    }
}

fn towards(degrees: f64, azimuth: f64) -> DVec3 {
    let (sine, cosine) = degrees.to_radians().sin_cos();
    DVec3::new(sine * azimuth.cos(), cosine, sine * azimuth.sin())
}

/// One pixel's width of a plate, seen at this angle.
fn seen(degrees: f64, extent: [u32; 2]) -> View {
    flat_view(3.0 * towards(degrees, 0.0).as_vec3(), Vec3::ZERO, 0.05, extent)
}

fn plate(matter: &Matter) -> Stage {
    let mut stage = Stage::new();
    let plate = stage.material(material(matter));
    stage.quad(plate, vec3(-5.0, 0.0, -5.0), Vec3::Z * 10.0, Vec3::X * 10.0);
    stage
}

/// Irradiance 2 from there.
fn sun(stage: &mut Stage, from: DVec3) {
    let world = Mat4::from_quat(glam::Quat::from_rotation_arc(Vec3::NEG_Z, -from.as_vec3()));
    stage.light(LightKind::Directional, Vec3::ONE, 2.0, world);
}

/// Of facets alone, times the cosine of the light.
fn closed_form(matter: &Matter, degrees: f64) -> DVec3 {
    // Light and viewer at the same angle: the half vector is the normal. D = 1 / (π α²), G / (4 n·l n·v), Schlick.
    let (cosine, alpha) = (degrees.to_radians().cos(), matter.roughness.powi(2));
    let slope2 = (1.0 - cosine * cosine) / (cosine * cosine);
    let shadow = 1.0 / (1.0 + 2.0 * 0.5 * ((1.0 + alpha * alpha * slope2).sqrt() - 1.0));
    let fresnel = matter.f0 + (1.0 - matter.f0) * (1.0 - cosine).powi(5);
    fresnel * (shadow / (PI * alpha * alpha * 4.0 * cosine))
}

/// What a picture of the plate shows, its mean in three channels.
fn pixel(values: &[[f32; 4]]) -> DVec3 {
    let sum: DVec3 = values.iter().map(|p| DVec3::new(p[0].into(), p[1].into(), p[2].into())).sum();
    sum / values.len() as f64
}

/// The direct pass of `isr` for each matter in a pixel of its own.
fn lit(gpu: &Gpu, matters: &[Matter], degrees: f64, suns: &[(DVec3, f64)]) -> Vec<DVec3> {
    let count = matters.len();
    let view = seen(degrees, [count as u32, 1]);
    let buffers = Buffers {
        width: count,
        height: 1,
        depth: vec![0.03; count],
        albedo: matters.iter().map(|m| m.albedo).collect(),
        mask: vec![1.0; count],
        normal: vec![DVec3::Y; count],
        sender: vec![DVec3::ZERO; count],
        factor: 1.0,
    };
    let mut graph = Graph::new("lit");
    let mut g = isr_lab::gbuffer_seen(&mut graph, &view, &buffers);
    let gloss: Vec<[f32; 4]> = matters.iter().map(|m| m.f0.as_vec3().extend(m.roughness as f32).to_array()).collect();
    g.specular = isr_lab::image(&mut graph, "gloss", Extent::new(count as u32, 1), &gloss);
    let lights: Vec<types::Light> = suns
        .iter()
        .map(|(from, irradiance)| types::Light {
            kind: consts::LIGHT_DIRECTIONAL,
            direction: (-*from).as_vec3().to_array(),
            intensity: [*irradiance as f32; 3],
            spot_offset: 1.0,
            ..Default::default()
        })
        .collect();
    let lights = isr_lab::lights(&mut graph, &lights);
    let choices = Direct::default();
    let lit = direct::light(&mut graph, &g, lights, &choices);
    let [direct] = isr_lab::read(gpu, graph, [lit.direct]);
    direct.iter().map(|p| pixel(&[*p])).collect()
}

#[track_caller]
fn close(what: &str, found: DVec3, exact: DVec3, slack: f64) {
    let off = (found - exact).abs() - exact.abs() * slack;
    assert!(off.max_element() <= 1e-4, "{what}: {found} instead of {exact}");
}

#[test]
fn highlights_of_isr_have_the_brightness_of_the_closed_form() {
    with_gpu(|gpu| {
        let matters = matters();
        for degrees in [10.0, 53.0, 75.0] {
            let found = lit(gpu, &matters, degrees, &[(towards(degrees, PI), 2.0)]);
            for (matter, found) in matters.iter().zip(found) {
                let cosine = degrees.to_radians().cos();
                let whole = matter.response(DVec3::Y, towards(degrees, 0.0), towards(degrees, PI));
                close(&format!("{matter:?} at {degrees}°"), found, 2.0 * whole, 3e-3);
                if matter.albedo == DVec3::ZERO && matter.roughness < 0.5 {
                    // Of the black dielectric and the smooth metal there is hardly more than the facets' own light.
                    let between = matter.matt(cosine) * (cosine / PI) * 1.5;
                    let exact = 2.0 * closed_form(matter, degrees);
                    let off = (found - exact).abs() - 2.0 * between;
                    assert!(off.max_element() < 5e-3 * exact.max_element(), "{matter:?} {degrees}: {found} {exact}");
                }
            }
        }
    });
}

#[test]
fn isr_reflects_what_the_integrals_say_of_light_from_everywhere() {
    with_gpu(|gpu| {
        let matters = matters();
        const SIDE: usize = 48;
        // Suns with the weights of a sky of radiance 1.
        let suns: Vec<(DVec3, f64)> = (0..SIDE * SIDE)
            .map(|k| {
                let u = ((k % SIDE) as f64 + 0.5) / SIDE as f64;
                let azimuth = 2.0 * PI * ((k / SIDE) as f64 + 0.5) / SIDE as f64;
                let cosine = (1.0 - u).sqrt();
                (towards(cosine.acos().to_degrees(), azimuth), PI / (cosine * (SIDE * SIDE) as f64))
            })
            .collect();
        for degrees in ANGLES {
            let found = lit(gpu, &matters, degrees, &suns);
            for (matter, found) in matters.iter().zip(found) {
                let viewer = towards(degrees, 0.0);
                let twin: DVec3 = suns.iter().map(|(l, e)| *e * matter.response(DVec3::Y, viewer, *l)).sum();
                close(&format!("{matter:?} at {degrees}°"), found, twin, 3e-3);
                // Highlights that are not narrower than the steps between the suns.
                if matter.roughness >= 0.5 {
                    let exact = matter.reflected(degrees.to_radians().cos(), 96);
                    let slack = if matter.albedo == DVec3::ZERO { 0.03 } else { 0.012 };
                    close(&format!("{matter:?} under a sky at {degrees}°"), found, exact, slack);
                }
            }
        }
    });
}

fn direct_only(samples: u32) -> igi::Settings {
    igi::Settings { indirect: false, direct_samples: samples, ..igi::Settings::default() }
}

#[test]
fn highlights_of_igi_and_of_the_path_tracer_have_the_brightness_of_the_closed_form() {
    with_gpu(|gpu| {
        for matter in matters().iter().filter(|m| m.roughness > 0.3) {
            for degrees in [10.0, 53.0, 75.0] {
                let mut stage = plate(matter);
                sun(&mut stage, towards(degrees, PI));
                let exact = 2.0 * matter.response(DVec3::Y, towards(degrees, 0.0), towards(degrees, PI));
                let view = seen(degrees, [8, 8]);
                let shown = igi_lab::Studio::new(gpu, &stage.scene).render(&view, &direct_only(1), 0);
                close(&format!("igi, {matter:?} at {degrees}°"), pixel(&shown.total), exact, 0.01);
                let settings = Tracing { bounces: 0, filter: Filter::Centre, ..Tracing::default() };
                let found = mean(&render(gpu, &stage.scene, &view, &settings, 2), "direct");
                close(&format!("reference, {matter:?} at {degrees}°"), DVec3::from_array(found), exact, 2e-3);
            }
        }
        // Facets alone, by their formula.
        let black = matters()[3];
        for degrees in [53.0f64, 75.0] {
            let exact = closed_form(&black, degrees);
            let whole = black.response(DVec3::Y, towards(degrees, 0.0), towards(degrees, PI));
            close("the twin", whole, exact, 5e-3);
        }
    });
}

#[test]
fn facets_that_face_down_reflect_no_light() {
    with_gpu(|gpu| {
        // The normal leans away from the viewer, and half between viewer and light is below its horizon.
        let (normal, viewer, light) = (towards(75.0, PI), towards(30.0, 0.0), towards(12.1, 0.0));
        assert!(normal.dot(viewer) < -0.2 && normal.dot(light) > 0.05 && normal.dot(viewer + light) < 0.0);
        let matter = Matter { roughness: 1.0, ..matters()[3] };
        assert_eq!(matter.facets(normal, viewer, light), DVec3::ZERO);
        let mut stage = plate(&matter);
        sun(&mut stage, light);
        let plate = stage.scene.meshes.last_mut().unwrap();
        plate.primitives[0].normals.iter_mut().for_each(|of| *of = normal.as_vec3());
        let exact = 2.0 * matter.response(normal, viewer, light);
        let settings = Tracing { bounces: 0, filter: Filter::Centre, ..Tracing::default() };
        let found = mean(&render(gpu, &stage.scene, &seen(30.0, [8, 8]), &settings, 2), "direct");
        println!("{found:?}, {exact}");
        close("reference", DVec3::from_array(found), exact, 2e-3);
    });
}

fn under_a_sky(matter: &Matter) -> Scene {
    Scene { environment: Some(Environment::constant(Vec3::ONE)), ..plate(matter).scene }
}

#[test]
fn a_plate_under_an_even_sky_neither_makes_nor_loses_light() {
    with_gpu(|gpu| {
        for matter in matters() {
            for degrees in ANGLES {
                let scene = under_a_sky(&matter);
                let exact = matter.reflected(degrees.to_radians().cos(), 128);
                let settings = Tracing { bounces: 0, filter: Filter::Centre, ..Tracing::default() };
                let layers = render(gpu, &scene, &seen(degrees, [32, 32]), &settings, 96);
                let (found, sigma) = (DVec3::from_array(mean(&layers, "")), deviation(&layers));
                println!("reference, {degrees}°, {matter:?}: {found:.4}, by integrals {exact:.4} ± {sigma:.5}");
                let most = 4.5 * sigma + 0.004;
                assert!((found - exact).abs().max_element() < most, "{matter:?} at {degrees}°: {found}, not {exact}");
                let white = matter.albedo == DVec3::ONE || matter.f0 == DVec3::ONE;
                assert!(!white || (found.x - 1.0).abs() < 0.01, "{matter:?} at {degrees}°: {found} of white");
            }
        }
    });
}

#[test]
fn igi_and_fiv_keep_white_white_under_an_even_sky() {
    with_gpu(|gpu| {
        for matter in matters().iter().filter(|m| m.roughness >= 0.4) {
            let scene = under_a_sky(matter);
            for degrees in ANGLES {
                let exact = matter.reflected(degrees.to_radians().cos(), 128);
                let view = seen(degrees, [24, 24]);
                let mut studio = igi_lab::Studio::new(gpu, &scene);
                let shown = studio.render(&view, &direct_only(64), 0);
                println!("igi, {degrees}°, {matter:?}: {:.4}, by integrals {exact:.4}", pixel(&shown.total));
                close(&format!("igi, {matter:?} at {degrees}°"), pixel(&shown.total), exact, 0.02);
                let settings = fiv::Settings {
                    size: 32,
                    method: fiv::Method::Unshadowed,
                    specular: fiv::Specular::Summed,
                    ..Default::default()
                };
                let mut studio = fiv_lab::Studio::new(gpu, &scene, &settings, None);
                let (_, total) = studio.shot(&Pose::rest(&scene), &seen(degrees, [1, 1]), &settings);
                let found = total[0].as_dvec3();
                println!("fiv, {degrees}°, {matter:?}: {found:.4}, by integrals {exact:.4}");
                // Texels are as wide as that lobe: seen from the side some of their light falls behind the surface.
                let slack = if matter.roughness < 0.5 && degrees > 60.0 { 0.06 } else { 0.02 };
                close(&format!("fiv, {matter:?} at {degrees}°"), found, exact, slack);
            }
        }
    });
}
