//! Whole frames of image-space radiosity on known surfaces: against closed forms, and that light scales as light must.

use crate::isr_lab;
use crate::isr_lab::{close, gbuffer, gbuffer_seen, lights, point, read};
use glam::{DVec2, DVec3, Mat4, Vec3, dvec3, vec3};
use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    graph::Graph,
    reference::isr_scene::{Buffers, Eye, Patch},
    scene::{Camera, Projection, View},
    techniques::isr::{self, Blur, Inputs, Outputs, Resolution, Sender, Settings, frame},
};

/// Floor and wall seen from above; 160 × 120. The floor reflects half, the wall nothing.
fn corner() -> (Eye, Vec<Patch>) {
    let eye = Eye::look_at(dvec3(0.3, 1.8, 2.2), dvec3(0.0, 0.3, -1.3), 0.9, 10.0, 160, 120);
    (eye, isr_lab::floor_and_wall(0.5))
}

fn declare(graph: &mut Graph, eye: &Eye, buffers: &Buffers, lamp: Vec3, settings: &Settings) -> Outputs {
    let gbuffer = gbuffer(graph, eye, buffers);
    let lights = lights(graph, &[point(vec3(0.2, 1.0, -0.6), lamp)]);
    let inputs = Inputs { gbuffer, lights, surroundings: Default::default(), senders: None };
    frame(graph, &inputs, settings).unwrap()
}

/// Total, direct, indirect, accessibility.
fn run(gpu: &Gpu, eye: &Eye, buffers: &Buffers, lamp: Vec3, settings: &Settings) -> [Vec<[f32; 4]>; 4] {
    let mut graph = Graph::new("isr");
    let out = declare(&mut graph, eye, buffers, lamp, settings);
    read(gpu, graph, [out.total, out.direct, out.indirect, out.occlusion])
}

#[test]
fn a_glowing_wall_lights_the_floor_as_the_closed_form_says() {
    with_gpu(|gpu| {
        let (eye, patches) = corner();
        let buffers = Buffers::cast(&eye, &patches, 1);
        for (samples, blur, resolution) in [
            (48, Blur::Bilateral, Resolution::Half),
            (80, Blur::Bilateral, Resolution::Half),
            (48, Blur::Bilateral, Resolution::Full),
            (48, Blur::Gaussian, Resolution::Half),
            (48, Blur::None, Resolution::Half),
            (80, Blur::None, Resolution::Full),
        ] {
            // The image is small: a blur of eight texels would be a quarter of the floor.
            let settings = Settings { samples, blur, resolution, blur_radius: 4, ..Settings::default() };
            let [_, _, indirect, _] = run(gpu, &eye, &buffers, Vec3::ZERO, &settings);
            let (mut ratios, mut squares, mut count) = (DVec3::ZERO, 0.0, 0.0);
            for y in 0..eye.height {
                for x in 0..eye.width {
                    let i = buffers.at(x, y);
                    let p = buffers.position(&eye, x, y);
                    // Floor, away from its borders, over which the Gaussian takes light.
                    if buffers.depth[i] < 1.0 && p.y < 1e-6 && p.x.abs() < 0.8 && (-1.6..-0.3).contains(&p.z) {
                        let exact = 0.5 * patches[1].reflected_by_white(p, DVec3::Y);
                        let found = dvec3(indirect[i][0].into(), indirect[i][1].into(), indirect[i][2].into());
                        ratios += found / exact;
                        squares += (found.x / exact.x - 1.0).powi(2);
                        count += 1.0;
                    }
                }
            }
            let (mean, error) = (ratios / count, f64::sqrt(squares / count));
            println!("{samples} samples, {blur:?}, {resolution:?}: mean {mean:.3}, relative error {error:.3}");
            assert!(count > 1000.0);
            assert!((mean - 1.0).abs().max_element() < 0.1, "{mean} of the true light");
            assert!(error < 0.12 || blur == Blur::None, "relative error {error}");
        }
    });
}

#[test]
fn an_orthographic_camera_gathers_the_same_light() {
    with_gpu(|gpu| {
        let (_, patches) = corner();
        // Parallel rays, 45° down onto floor and wall.
        let (width, height, half, far) = (160usize, 120usize, DVec2::new(2.0, 1.5), 10.0);
        let forward = dvec3(0.0, -1.0, -1.0).normalize();
        let (right, middle) = (DVec3::X, dvec3(0.0, 0.5, -1.5) - forward * 4.0);
        let up = right.cross(forward);
        let mut buffers = Buffers { width, height, factor: 1.0, ..Buffers::default() };
        let mut places = Vec::new();
        for y in 0..height {
            for x in 0..width {
                let u = 2.0 * (x as f64 + 0.5) / width as f64 - 1.0;
                let v = 1.0 - 2.0 * (y as f64 + 0.5) / height as f64;
                let origin = middle + right * u * half.x + up * v * half.y;
                let hits = patches.iter().filter_map(|p| p.hit(origin, forward).map(|t| (t, p)));
                let hit = hits.min_by(|a, b| a.0.total_cmp(&b.0));
                places.push(hit.map(|(t, patch)| (origin + forward * t, patch.normal())));
                buffers.depth.push(hit.map_or(1.0, |(t, _)| t / far));
                buffers.albedo.push(hit.map_or(DVec3::ZERO, |(_, p)| p.albedo));
                buffers.normal.push(hit.map_or(DVec3::ZERO, |(_, p)| p.normal()));
                buffers.sender.push(hit.map_or(DVec3::ZERO, |(_, p)| p.radiance));
                buffers.mask.push(if hit.is_some() { 1.0 } else { 0.0 });
            }
        }
        let projection =
            Projection::Orthographic { xmag: half.x as f32, ymag: half.y as f32, znear: 0.1, zfar: far as f32 };
        let columns = [right, up, -forward].map(|c| c.as_vec3().extend(0.0));
        let place = Mat4::from_cols(columns[0], columns[1], columns[2], middle.as_vec3().extend(1.0));
        let view = View::new(&Camera { name: String::new(), projection }, place, [width as u32, height as u32]);
        let mut graph = Graph::new("orthographic");
        let gbuffer = gbuffer_seen(&mut graph, &view, &buffers);
        let lights = lights(&mut graph, &[]);
        let inputs = Inputs { gbuffer, lights, surroundings: Default::default(), senders: None };
        let out = frame(&mut graph, &inputs, &Settings { blur_radius: 4, ..Settings::default() }).unwrap();
        let [indirect] = read(gpu, graph, [out.indirect]);
        let (mut ratios, mut count) = (0.0, 0.0);
        for (texel, place) in indirect.iter().zip(&places) {
            if let Some((p, normal)) = *place
                && normal.y > 0.9
                && p.x.abs() < 0.8
                && (-1.6..-0.3).contains(&p.z)
            {
                ratios += f64::from(texel[0]) / (0.5 * patches[1].reflected_by_white(p, DVec3::Y).x);
                count += 1.0;
            }
        }
        assert!(count > 1000.0, "{count}");
        assert!((ratios / count - 1.0f64).abs() < 0.1, "{} of the true light", ratios / count);
    });
}

#[test]
fn indirect_light_scales_with_light_and_albedo() {
    with_gpu(|gpu| {
        let (eye, mut patches) = corner();
        patches[1].radiance = DVec3::ZERO;
        patches[1].albedo = dvec3(0.8, 0.4, 0.1);
        let lamp = vec3(3.0, 3.0, 3.0);
        let indirect = |patches: &[Patch], lamp: Vec3, settings: &Settings| {
            run(gpu, &eye, &Buffers::cast(&eye, patches, 1), lamp, settings)[2].clone()
        };
        let settings = Settings::default();
        let once = indirect(&patches, lamp, &settings);
        assert!(once.iter().any(|t| t[0] > 0.01));
        // Light: linear.
        let scaled: Vec<[f32; 4]> = once.iter().map(|t| t.map(|c| 4.0 * c)).collect();
        close(&indirect(&patches, 4.0 * lamp, &settings), &scaled, 0..3, 1e-4, 3e-3);
        // No light, no indirect light.
        assert!(indirect(&patches, Vec3::ZERO, &settings).iter().all(|t| t[..3] == [0.0; 3]));
        // A black room reflects nothing, whatever the light.
        let mut black = patches.clone();
        black.iter_mut().for_each(|p| p.albedo = DVec3::ZERO);
        assert!(indirect(&black, lamp, &settings).iter().all(|t| t[..3] == [0.0; 3]));
        // Both albedos halved: a quarter. One bounce is of degree two.
        let mut half = patches.clone();
        half.iter_mut().for_each(|p| p.albedo *= 0.5);
        let quarter: Vec<[f32; 4]> = once.iter().map(|t| t.map(|c| 0.25 * c)).collect();
        close(&indirect(&half, lamp, &settings), &quarter, 0..3, 1e-4, 4e-3);
        // k_isr: linear; zero switches off.
        let weak = indirect(&patches, lamp, &Settings { k_isr: 0.25, ..settings.clone() });
        close(&weak, &quarter, 0..3, 1e-4, 3e-3);
        // More bounces add light, each less than the one before.
        let sum = |texels: &[[f32; 4]]| texels.iter().map(|t| f64::from(t[0])).sum::<f64>();
        let bounced: Vec<f64> =
            (1..=4).map(|bounces| sum(&indirect(&patches, lamp, &Settings { bounces, ..settings.clone() }))).collect();
        let added: Vec<f64> = bounced.windows(2).map(|w| w[1] - w[0]).collect();
        assert!(added[0] > 0.0 && added[1] < added[0] && added[2] < added[1], "{bounced:?}");
    });
}

#[test]
fn the_papers_choices_bleed_colour_and_darken_corners() {
    with_gpu(|gpu| {
        let (eye, mut patches) = corner();
        patches[1].radiance = DVec3::ZERO;
        patches[1].albedo = dvec3(1.0, 0.1, 0.0);
        let buffers = Buffers::cast(&eye, &patches, 1);
        let settings = Settings::paper();
        let [total, direct, indirect, open] = run(gpu, &eye, &buffers, vec3(1.0, 1.0, 1.0), &settings);
        let mean = |texels: &[[f32; 4]], channel: usize, near: f64, far: f64| {
            let (mut sum, mut count) = (0.0, 0.0);
            for (i, t) in texels.iter().enumerate() {
                let p = buffers.position(&eye, i % eye.width, i / eye.width);
                if buffers.depth[i] < 1.0 && p.y < 1e-6 && p.x.abs() < 0.5 && (near..far).contains(&(p.z + 2.0)) {
                    sum += f64::from(t[channel]);
                    count += 1.0;
                }
            }
            assert!(count > 20.0);
            sum / count
        };
        // Red light on the floor beside the red wall, little at a distance; occlusion likewise.
        assert!(mean(&indirect, 0, 0.0, 0.2) > 3.0 * mean(&indirect, 1, 0.0, 0.2));
        assert!(mean(&indirect, 0, 0.0, 0.2) > 1.5 * mean(&indirect, 0, 1.0, 1.5));
        assert!(mean(&open, 0, 0.0, 0.2) < mean(&open, 0, 1.0, 1.5) - 0.05);
        // [ISR 29], pixel by pixel: `indirect` holds k_ISR L_ISR.
        for i in 0..total.len() {
            let lit = (open[i][0] + 1.0 - settings.k_ssao).clamp(0.0, 1.0);
            let expected = direct[i][0] * lit + indirect[i][0];
            assert!((total[i][0] - expected).abs() < 2e-3 + 2e-3 * expected, "pixel {i}");
        }
    });
}

#[test]
fn background_stays_empty_and_finite_everywhere() {
    with_gpu(|gpu| {
        let (eye, patches) = corner();
        let buffers = Buffers::cast(&eye, &patches, 1);
        for settings in
            [Settings::default(), Settings::paper(), Settings { visibility_steps: 6, ..Settings::default() }]
        {
            let [total, ..] = run(gpu, &eye, &buffers, Vec3::ONE, &settings);
            for (t, z) in total.iter().zip(&buffers.depth) {
                assert!(t.iter().all(|c| c.is_finite() && *c >= 0.0), "{t:?}");
                assert_eq!(t[3], if *z < 1.0 { 1.0 } else { 0.0 });
                assert!(*z < 1.0 || t[..3] == [0.0; 3]);
            }
        }
    });
}

#[test]
fn wrong_settings_are_refused_before_any_pass() {
    let (eye, patches) = corner();
    let buffers = Buffers::cast(&eye, &patches, 8);
    let mut graph = Graph::new("refused");
    let gbuffer = gbuffer(&mut graph, &eye, &buffers);
    let lights = lights(&mut graph, &[]);
    let before = graph.pass_count();
    let inputs = Inputs { gbuffer, lights, surroundings: Default::default(), senders: None };
    let error = frame(&mut graph, &inputs, &Settings { samples: 47, ..Settings::default() }).unwrap_err();
    assert_eq!(error.to_string(), "samples: 47 is not allowed; allowed: 24, 48, 80, 120, 168, 224");
    assert_eq!(graph.pass_count(), before);
}

#[test]
fn every_barrier_of_the_shipped_graphs_matters() {
    let (eye, patches) = corner();
    let buffers = Buffers::cast(&eye, &patches, 8);
    for settings in [
        Settings::default(),
        Settings::paper(),
        Settings { bounces: 3, blur: Blur::None, sender: Sender::Albedo, ..Settings::default() },
    ] {
        let mut graph = Graph::new("isr");
        let out: isr::Outputs = declare(&mut graph, &eye, &buffers, Vec3::ONE, &settings);
        for image in [out.total, out.direct, out.indirect, out.occlusion] {
            graph.read_image(image);
        }
        lucerna::graph::testing::every_barrier_matters(&graph);
    }
}
