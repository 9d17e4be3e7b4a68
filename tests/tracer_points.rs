//! The low-discrepancy points of the path tracer: their projections, their independence, and the error of pictures.

use crate::tracer_lab::{chi_square, sidak};
use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    graph::{Graph, Runner},
    scene::{Pose, View},
    shaders::{consts, test::points as shader},
    tracer::{Points, Settings, Tracer},
};
use lucerna_scenes as builtin;

/// Two pairs of words for each sample of each pixel of a square picture.
fn draw(gpu: &Gpu, width: u32, samples: u32, plan: u32, seed: u32) -> Vec<[u32; 4]> {
    let count = width * width * samples;
    let mut graph = Graph::new("points");
    let drawn = graph.buffer("drawn", u64::from(count) * 16);
    graph.compute(shader::Args { drawn, push: shader::Push { width, samples, plan, seed } }, count);
    let token = graph.read_buffer(drawn);
    Runner::new(gpu).run(&graph).unwrap().buffer(token)
}

/// Each of the 2^m intervals of every shape with area 2^-m has one of the 2^m points: a (0, m, 2)-net in base 2.
fn is_net(points: &[[u32; 2]]) -> bool {
    let m = points.len().ilog2();
    assert_eq!(points.len(), 1 << m);
    (0..=m).all(|along| {
        let mut found = vec![false; points.len()];
        points.iter().all(|[x, y]| {
            let top = |word: &u32, bits: u32| u64::from(*word) >> (32 - bits);
            let cell = (top(x, along) << (m - along) | top(y, m - along)) as usize;
            !std::mem::replace(&mut found[cell], true)
        })
    })
}

fn pair(points: &[[u32; 4]], which: usize) -> Vec<[u32; 2]> {
    points.iter().map(|p| [p[2 * which], p[2 * which + 1]]).collect()
}

#[test]
fn every_part_of_a_pixels_points_is_a_net() {
    with_gpu(|gpu| {
        for seed in [0, 5] {
            let drawn = draw(gpu, 4, 256, consts::POINTS_APART, seed);
            for pixel in drawn.chunks_exact(256) {
                for which in [0, 1] {
                    let points = pair(pixel, which);
                    for size in [1, 2, 4, 16, 64, 256] {
                        assert!(points.chunks_exact(size).all(is_net), "parts of {size} points");
                    }
                }
            }
            // Independent numbers are none.
            let random = draw(gpu, 4, 256, consts::POINTS_RANDOM, seed);
            assert!(!is_net(&pair(&random[..256], 0)));
        }
    });
}

#[test]
fn planned_points_are_nets_over_squares_of_pixels() {
    with_gpu(|gpu| {
        const WIDTH: usize = 72;
        let drawn = draw(gpu, WIDTH as u32, 4, 2, 9);
        for which in [0, 1] {
            let points = pair(&drawn, which);
            for side in [1, 2, 4, 8, 16, 64] {
                // The 64 × 64 pixels of the first tile, and the next tile as far as it is there.
                let squares = (0..WIDTH / side).flat_map(|y| (0..WIDTH / side).map(move |x| [x * side, y * side]));
                for [x, y] in squares {
                    let pixels = (0..side * side).map(|i| (y + i / side) * WIDTH + x + i % side);
                    let all: Vec<_> = pixels.flat_map(|p| points[4 * p..4 * p + 4].to_vec()).collect();
                    assert!(is_net(&all), "pair {which} over {side}×{side} pixels at {x}, {y}");
                }
            }
        }
        // More samples than planned are a new sequence: again a net, and not the same.
        let more = draw(gpu, 8, 8, 2, 9);
        for pixel in more.chunks_exact(8) {
            let points = pair(pixel, 0);
            assert!(is_net(&points[4..]) && points[..4] != points[4..]);
        }
    });
}

#[test]
fn points_are_even_and_pairs_independent() {
    with_gpu(|gpu| {
        // (plan, samples): the first point of many pixels, and all points of few.
        for (run, plan) in [consts::POINTS_APART, consts::POINTS_RANDOM, 0, 4].into_iter().enumerate() {
            let drawn = draw(gpu, 256, 2, plan, 40 + run as u32);
            // One point of each pixel, and of neighbours only one: points of a net are more even than independent ones.
            let some: Vec<_> = drawn.chunks_exact(2).map(|pixel| pixel[1]).collect();
            let bin = |word: u32| (word >> 29) as usize;
            for (a, b) in [(0, 2), (0, 3), (1, 2), (1, 3)] {
                let mut counts = vec![0.0; 64];
                some.iter().for_each(|p| counts[bin(p[a]) * 8 + bin(p[b])] += 1.0);
                let p = chi_square(&counts, &vec![some.len() as f64 / 64.0; 64]);
                assert!(p > sidak(40), "plan {plan}, words {a} and {b}: p = {p:e}");
            }
            for word in 0..4 {
                let mut counts = vec![0.0; 64];
                some.iter().for_each(|p| counts[(p[word] >> 26) as usize] += 1.0);
                let p = chi_square(&counts, &vec![some.len() as f64 / 64.0; 64]);
                assert!(p > sidak(40), "plan {plan}, word {word}: p = {p:e}");
                // The last bits are even, too: light is chosen by all of them.
                let ones = some.iter().filter(|p| p[word] >> 4 & 1 == 1).count() as f64;
                let half = some.len() as f64 / 2.0;
                assert!((ones - half).abs() < 6.0 * (half / 2.0).sqrt(), "plan {plan}, word {word}: {ones} of {half}");
            }
        }
    });
}

/// Pictures of the Cornell box with different seeds: for each the luminance of its pixels.
fn pictures(gpu: &Gpu, settings: &Settings, samples: u32) -> Vec<Vec<f64>> {
    let scene = builtin::load("cornell-area").unwrap();
    let pose = Pose::rest(&scene);
    let view = View::of_camera(&scene, &pose, 0, [48, 48]).unwrap();
    let mut tracer = Tracer::new(gpu, &scene, &pose).unwrap();
    (0..4)
        .map(|seed| {
            let settings = Settings { seed, bounces: 1, diffuse_only: true, ..settings.clone() };
            let layers = tracer.render(&view, &settings, samples).unwrap();
            let sum = |i: usize| -> f64 {
                let value = |name| f64::from(layers.layer(name).unwrap().data[i * 3 + 1]);
                value("direct") + value("indirect")
            };
            (0..48 * 48).map(sum).collect()
        })
        .collect()
}

/// Mean over the pixels, and mean variance.
fn statistics(pictures: &[Vec<f64>]) -> (f64, f64) {
    let count = pictures.len() as f64;
    let mut sums = (0.0, 0.0);
    for i in 0..pictures[0].len() {
        let mean = pictures.iter().map(|p| p[i]).sum::<f64>() / count;
        let variance = pictures.iter().map(|p| (p[i] - mean).powi(2)).sum::<f64>() / (count - 1.0);
        sums = (sums.0 + mean, sums.1 + variance);
    }
    (sums.0 / pictures[0].len() as f64, sums.1 / pictures[0].len() as f64)
}

/// Means over squares of 4 × 4 pixels.
fn coarse(picture: &[f64]) -> Vec<f64> {
    let mean = |x: usize, y: usize| (0..16).map(|i| picture[(4 * y + i / 4) * 48 + 4 * x + i % 4]).sum::<f64>() / 16.0;
    (0..144).map(|i| mean(i % 12, i / 12)).collect()
}

#[test]
fn the_same_light_with_less_noise() {
    with_gpu(|gpu| {
        let with = |points, planned| Settings { points, planned, ..Settings::default() };
        let random = pictures(gpu, &with(Points::Random, 0), 16);
        let sobol = pictures(gpu, &with(Points::Sobol, 0), 16);
        let planned = pictures(gpu, &with(Points::Sobol, 16), 16);
        let [(mean, noise), (mean_sobol, noise_sobol), (mean_planned, noise_planned)] =
            [&random, &sobol, &planned].map(|p| statistics(p));
        println!("variance {noise:.3e} random, {noise_sobol:.3e} Sobol, {noise_planned:.3e} planned");
        let slack = 5.0 * (noise / (4.0 * 48.0 * 48.0)).sqrt();
        assert!(
            (mean_sobol - mean).abs() < slack && (mean_planned - mean).abs() < slack,
            "{mean} {mean_sobol} {mean_planned}"
        );
        assert!(noise_sobol < 0.6 * noise && noise_planned < 0.6 * noise);
        // Errors of neighbours have opposite signs: less is left of them in the mean of a square.
        let [apart, blue] = [&sobol, &planned].map(|p| statistics(&p.iter().map(|p| coarse(p)).collect::<Vec<_>>()).1);
        println!("variance of squares {apart:.3e} without a plan, {blue:.3e} planned");
        assert!(blue < 0.7 * apart, "{blue} {apart}");
    });
}
