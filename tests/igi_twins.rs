//! The filters of instant global illumination against CPU implementations (twins), on random irradiance over surfaces with edges, steps and
//! background.

use crate::igi_lab::twins::{self, Texels, blended, joined, smoothed, upsampled};
use crate::isr_lab::{Random, gbuffer, image, read, scene, view};
use glam::{DVec3, dvec3};
use lucerna::{
    gpu::testing::with_gpu,
    graph::{Extent, Graph},
    reference::isr_scene::{Buffers, Eye},
    shaders::types,
    techniques::igi::{
        Settings, filters,
        history::{self, Grid},
    },
};

/// The normal (`None`: no surface), and the light in the last frame and in this one.
type Probe = (Option<DVec3>, DVec3, DVec3);

const SIZE: (usize, usize) = (45, 34);

fn extent() -> Extent {
    Extent::new(SIZE.0 as u32, SIZE.1 as u32)
}

fn stage() -> (Eye, Buffers) {
    let (_, patches) = scene(SIZE.0, SIZE.1);
    let eye = Eye::look_at(dvec3(0.3, 1.2, 0.9), dvec3(0.0, 0.25, -1.3), 0.8, 10.0, SIZE.0, SIZE.1);
    let buffers = Buffers::cast(&eye, &patches, 1);
    let seen = buffers.depth.iter().filter(|z| **z < 1.0).count();
    assert!(seen > 600 && seen < SIZE.0 * SIZE.1, "{seen} pixels show something");
    (eye, buffers)
}

/// Fails if more than `most` of the compared values are further than `slack` from the twin.
#[track_caller]
fn agree(found: &[f32], expected: &[f64], slack: f64, most: usize, what: &str) {
    let off: Vec<usize> = (0..found.len())
        .filter(|&i| (f64::from(found[i]) - expected[i]).abs() > slack * (1.0 + expected[i].abs()))
        .collect();
    let first = off.first().map(|&i| (i, found[i], expected[i]));
    assert!(off.len() <= most, "{what}: {} of {} values differ, the first {first:?}", off.len(), found.len());
}

#[test]
fn upsampling_and_the_fused_filter_agree_with_their_twin() {
    with_gpu(|gpu| {
        let (eye, buffers) = stage();
        let mut random = Random(11);
        // With factor 1 the fused filter reads interleaved texels at full resolution.
        for (downsample, sigma, upsample_range, upsample_normal, scattered) in [
            (1, 1.2, 0.01, 8.0, false),
            (2, 0.6, 0.01, 8.0, false),
            (3, 0.9, 0.0, 1.0, false),
            (4, 0.6, 0.05, 3.0, false),
            (4, 1.5, 0.01, 0.0, false),
            (3, 0.7, 0.01, 8.0, true),
            (4, 1.1, 0.02, 2.0, true),
            // A narrow Gaussian has a small weight at the next texel, which must be right as well.
            (4, 0.1, 0.01, 8.0, false),
            (2, 0.1, 0.0, 1.0, false),
            (3, 0.15, 0.01, 8.0, true),
        ] {
            let s = Settings {
                downsample,
                upsample_sigma: sigma,
                upsample_range,
                upsample_normal,
                scattered,
                ..Settings::default()
            };
            let small = extent().div_ceil(downsample);
            let noise: Texels = (0..small.pixels()).map(|_| random.texel()).collect();
            let mut graph = Graph::new("upsample");
            let g = gbuffer(&mut graph, &eye, &buffers);
            let guide = filters::guide(&mut graph, &g, &s);
            let coarse = image(&mut graph, "noise", small, &noise);
            let (fine, _) = filters::upsample(&mut graph, &g, guide, coarse, &s);
            let [fine] = read(gpu, graph, [fine]);
            let (mut found, mut expected) = (Vec::new(), Vec::new());
            for (i, fine) in fine.iter().enumerate() {
                if let Some(color) = upsampled(&eye, &buffers, &noise, &s, (i % SIZE.0, i / SIZE.0)) {
                    found.extend_from_slice(&fine[..3]);
                    expected.extend(color.to_array());
                }
            }
            assert!(found.len() > 1500, "{} values", found.len());
            agree(&found, &expected, 2e-4, 0, &format!("factor {downsample}, sigma {sigma}"));
        }
    });
}

#[test]
fn smoothing_agrees_with_its_twin() {
    with_gpu(|gpu| {
        let (eye, buffers) = stage();
        let mut random = Random(14);
        for (downsample, smoothing, upsample_range, upsample_normal, scattered) in
            [(1, 1, 0.01, 8.0, false), (2, 3, 0.01, 8.0, true), (3, 2, 0.0, 1.0, false), (4, 1, 0.05, 3.0, true)]
        {
            let s =
                Settings { downsample, smoothing, upsample_range, upsample_normal, scattered, ..Settings::default() };
            let small = extent().div_ceil(downsample);
            let noise: Texels = (0..small.pixels()).map(|_| random.texel()).collect();
            let mut graph = Graph::new("smooth");
            let g = gbuffer(&mut graph, &eye, &buffers);
            let guide = filters::guide(&mut graph, &g, &s);
            let texels = image(&mut graph, "noise", small, &noise);
            let out = filters::smooth(&mut graph, &g, guide, texels, &s);
            let [out] = read(gpu, graph, [out]);
            let columns = small.width as usize;
            let mut turned: Vec<DVec3> = noise.iter().map(|t| dvec3(t[0].into(), t[1].into(), t[2].into())).collect();
            for turn in 0..smoothing {
                let at = |i: usize| smoothed(&eye, &buffers, &turned, &s, 1 << turn, (i % columns, i / columns));
                turned = (0..out.len()).map(at).collect();
            }
            let expected: Vec<f64> = turned.iter().flat_map(|color| color.to_array()).collect();
            let found: Vec<f32> = out.iter().flat_map(|texel| [texel[0], texel[1], texel[2]]).collect();
            agree(&found, &expected, 2e-4, 0, &format!("factor {downsample}, {smoothing} turns"));
        }
    });
}

#[test]
fn the_discontinuity_buffer_agrees_with_its_twin() {
    with_gpu(|gpu| {
        let (eye, buffers) = stage();
        let mut random = Random(12);
        for (downsample, interleave, discontinuity_depth, discontinuity_normal) in
            [(1, 3, 0.05, 0.9), (1, 4, 0.004, -1.0), (2, 2, 1e6, 0.9), (3, 3, 0.05, 0.5)]
        {
            let s =
                Settings { downsample, interleave, discontinuity_depth, discontinuity_normal, ..Settings::default() };
            let small = extent().div_ceil(downsample);
            let noise: Texels = (0..small.pixels()).map(|_| random.texel()).collect();
            let mut graph = Graph::new("join");
            let g = gbuffer(&mut graph, &eye, &buffers);
            let guide = filters::guide(&mut graph, &g, &s);
            let texels = image(&mut graph, "noise", small, &noise);
            let out = filters::join(&mut graph, guide, texels, &s);
            let [out] = read(gpu, graph, [out]);
            let columns = small.width as usize;
            let expected: Vec<f64> = (0..out.len())
                .flat_map(|i| joined(&buffers, &noise, &s, (i % columns, i / columns)).to_array())
                .collect();
            let found: Vec<f32> = out.iter().flat_map(|texel| [texel[0], texel[1], texel[2]]).collect();
            // Rounding decides about neighbours exactly at a threshold.
            agree(&found, &expected, 1e-5, 6, &format!("factor {downsample}, tile {interleave}"));
        }
    });
}

#[test]
fn the_history_agrees_with_its_twin() {
    with_gpu(|gpu| {
        let (eye, buffers) = stage();
        let (_, patches) = scene(SIZE.0, SIZE.1);
        let mut random = Random(13);
        // The camera has not moved, has moved, or has rotated.
        let eyes = [
            eye,
            Eye::look_at(dvec3(0.33, 1.16, 0.95), dvec3(0.02, 0.25, -1.3), 0.8, 10.0, SIZE.0, SIZE.1),
            Eye::look_at(dvec3(0.3, 1.2, 0.9), dvec3(0.5, 0.1, -1.3), 0.8, 11.0, SIZE.0, SIZE.1),
        ];
        for (turn, before) in eyes.iter().enumerate() {
            let mut then = Buffers::cast(before, &patches, 1);
            // A third of the surfaces faced another way, by up to some 50 degrees.
            for normal in then.normal.iter_mut() {
                let other = (*normal + 0.8 * random.vector()).normalize_or_zero();
                *normal = if random.next() < 0.33 { other } else { *normal };
            }
            let s = Settings { history: 12, history_lag: 0.2, ..Settings::default() };
            let all = SIZE.0 * SIZE.1;
            let fresh: Texels = (0..all).map(|_| random.texel()).collect();
            // A tenth of the pixels has no past; the others have between 1 and 12 frames.
            let old: Texels = (0..all)
                .map(|_| {
                    let [r, g, b, a] = random.texel();
                    [r, g, b, if a < 0.1 { 0.0 } else { 1.0 + 11.0 * a }]
                })
                .collect();
            // The light has grown, shrunk or not changed.
            let trend: Texels =
                (0..all).map(|_| random.texel().map(|v| v - 0.5)).map(|[r, g, b, a]| [r, g, b, a + 0.5]).collect();
            // A quarter of the pixels has moved, some of them within their own plane.
            let motion: Texels = (0..all)
                .map(|i| {
                    let (u, v) = buffers.uv(&eye, i % SIZE.0, i / SIZE.0);
                    let p = eye.position_at(u, v, buffers.depth[i]);
                    let along = buffers.normal[i].any_orthonormal_vector() * (0.1 * random.next());
                    let off = random.vector() * 0.02 * f64::from(u8::from(random.next() < 0.5));
                    let w = f32::from(u8::from(random.next() < 0.25 && buffers.depth[i] < 1.0));
                    let p = if w > 0.0 { p + along + off } else { DVec3::ZERO };
                    p.as_vec3().extend(w).to_array()
                })
                .collect();
            let grid = Grid::new(extent(), 1);
            let mut light = || dvec3(random.next(), random.next(), random.next());
            let mut probes = Vec::new();
            for i in 0..grid.count() {
                let was = light();
                // The light of some probes is unchanged, of some it has drifted, of some it is unrelated.
                let is = match i % 3 {
                    0 => was,
                    1 => was * 1.02,
                    _ => light(),
                };
                probes.push(((i % 5 != 4).then(|| light().normalize()), was, is));
            }
            let single = |p: DVec3| p.as_vec3().to_array();
            let placed: Vec<types::HistoryProbe> = probes
                .iter()
                .map(|(normal, ..)| types::HistoryProbe {
                    normal: single(normal.unwrap_or_default()),
                    there: normal.is_some().into(),
                    ..Default::default()
                })
                .collect();
            let lights = |pick: fn(&Probe) -> DVec3| -> Vec<[f32; 4]> {
                probes.iter().map(|probe| pick(probe).as_vec3().extend(0.0).to_array()).collect()
            };
            let mut graph = Graph::new("history");
            graph.frame = 7;
            let g = gbuffer(&mut graph, &eye, &buffers);
            let seen = view(before);
            let guides: Texels = (0..all)
                .map(|i| then.normal[i].normalize_or_zero().as_vec3().extend(then.depth[i] as f32).to_array())
                .collect();
            let past = history::Past {
                frame: graph.buffer_from(
                    "frame",
                    &[types::HistoryFrame { view: seen.uniform(), next: 7, ..Default::default() }],
                ),
                irradiance: image(&mut graph, "old", extent(), &old),
                guide: image(&mut graph, "old guide", extent(), &guides),
                trend: image(&mut graph, "old trend", extent(), &trend),
                probes: graph.buffer_from("probes", &placed),
                lit: graph.buffer_from("lit", &lights(|p| p.1)),
                relit: graph.buffer_from("relit", &lights(|p| p.2)),
            };
            let motion_image = image(&mut graph, "motion", extent(), &motion);
            let fresh_image = image(&mut graph, "fresh", extent(), &fresh);
            let next =
                ["blended", "guide", "trend"].map(|name| graph.image(name, lucerna::graph::Format::RGBA32F, extent()));
            history::blend(&mut graph, &g, (motion_image, fresh_image), (&past, grid), next, &s);
            let [out, kept, goes] = read(gpu, graph, next);

            let clip_from_world = seen.clip_from_world.as_dmat4();
            let columns = grid.columns as usize;
            let past = twins::Past {
                eye: before,
                clip_from_world,
                buffers: &then,
                irradiance: &old,
                trend: &trend,
                motion: &motion,
                probes,
                columns,
                side: grid.side as usize,
            };
            let expected: Vec<_> =
                (0..all).map(|i| blended(&eye, &buffers, &fresh, &past, &s, (i % SIZE.0, i / SIZE.0))).collect();
            let found: Vec<f32> = out.iter().flatten().copied().collect();
            let wanted: Vec<f64> = expected.iter().flat_map(|(e, _)| e.to_array()).collect();
            // Rounding decides about surfaces exactly at a threshold.
            agree(&found, &wanted, 1e-3, 4 * all / 100, &format!("camera {turn}"));
            let found: Vec<f32> = goes.iter().flatten().copied().collect();
            let wanted: Vec<f64> = expected.iter().flat_map(|(_, t)| t.to_array()).collect();
            agree(&found, &wanted, 1e-3, 4 * all / 100, &format!("trend, camera {turn}"));
            if turn == 0 {
                // Around the limit that tells surfaces apart, on both sides.
                let like = |i: usize| then.normal[i].dot(buffers.normal[i].normalize_or_zero());
                let within = |range: std::ops::Range<f64>| (0..all).filter(|&i| range.contains(&like(i))).count();
                let [apart, alike] = [within(0.6..0.9), within(0.9..0.97)];
                assert!(apart > 30 && alike > 30, "{apart} turned too far, {alike} nearly so");
            }
            let reused = expected.iter().filter(|(e, _)| e.w > 1.5).count();
            let alone = expected.iter().filter(|(e, _)| e.w == 1.0).count();
            assert!(reused > all / 5 && alone > 5, "camera {turn}: {reused} reused, {alone} alone");
            for (i, texel) in kept.iter().enumerate() {
                assert!((f64::from(texel[3]) - buffers.depth[i]).abs() < 1e-6, "depth {i}: {texel:?}");
            }
        }
    });
}
