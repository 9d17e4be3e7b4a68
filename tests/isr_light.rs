//! Direct light, upsampling and the sum of all light on the device, against closed forms and the CPU reference.

use crate::isr_lab::{Random, close, gbuffer, image, lights, point, read, scene};
use glam::{DVec3, Vec3, dvec3, vec3};
use lucerna::{
    gpu::testing::with_gpu,
    graph::{Extent, Graph},
    passes::{
        ambient::Irradiance,
        compose::{self, Compose},
        direct::{self, Direct},
        downsample::Coarse,
    },
    reference::{
        isr as cpu,
        isr_scene::{Buffers, Eye},
    },
    shaders,
};
use std::f64::consts::PI;

#[test]
fn composing_is_equations_27_to_29() {
    with_gpu(|gpu| {
        // A full-resolution plane with a step: columns 0..8 at 2 m, the others at 4 m. Coarse texels on the same surfaces.
        let (width, height) = (16, 8);
        let eye = Eye::look_at(DVec3::ZERO, -DVec3::Z, 0.9, 10.0, width, height);
        let mut random = Random(5);
        let mut fine = Buffers { width, height, factor: 1.0, ..Buffers::default() };
        for i in 0..width * height {
            fine.depth.push(if i % width < 7 { 0.2 } else { 0.4 });
            fine.normal.push(DVec3::Z);
            fine.albedo.push(dvec3(0.5, 0.25, 0.75));
            fine.mask.push(1.0);
            fine.sender.push(DVec3::ZERO);
        }
        let (cw, ch) = (8usize, 4usize);
        let coarse_depth: Vec<f32> = (0..cw * ch).map(|i| if i % cw < 4 { 0.2 } else { 0.4 }).collect();
        let gathered: Vec<[f32; 4]> = (0..cw * ch).map(|_| random.texel()).collect();
        let direct: Vec<[f32; 4]> = (0..width * height).map(|_| random.texel()).collect();
        for (plane, tint, occlude_ambient) in [(false, false, false), (true, true, true)] {
            let mut graph = Graph::new("compose");
            let mut g = gbuffer(&mut graph, &eye, &fine);
            // Every third pixel is as bright as a metal beyond a dielectric's 4 %.
            let mirror = |i: usize| if i.is_multiple_of(3) { dvec3(0.8, 0.5, 0.25) } else { DVec3::ZERO };
            let specular: Vec<[f32; 4]> =
                (0..width * height).map(|i| (mirror(i) + 0.04).as_vec3().extend(1.0).to_array()).collect();
            g.specular = image(&mut graph, "specular", Extent::new(16, 8), &specular);
            let ambient = Irradiance::constant(Vec3::splat(if tint { 0.4 } else { 0.0 })).upload(&mut graph);
            let coarse_extent = Extent::new(cw as u32, ch as u32);
            let depth: Vec<_> = coarse_depth.iter().map(|z| [*z; 4]).collect();
            let depth = image(&mut graph, "coarse depth", coarse_extent, &depth);
            let normal = image(&mut graph, "coarse normal", coarse_extent, &vec![[0.0, 0.0, 1.0, 0.0]; cw * ch]);
            let coarse = image(&mut graph, "gathered", coarse_extent, &gathered);
            let direct_image = image(&mut graph, "direct", Extent::new(16, 8), &direct);
            let choices =
                Compose { factor: 2, plane, epsilon: 1e-3, tint, occlude_ambient, k_ssao: 0.6, k_isr: 0.7, area: None };
            let sum = compose::sum(
                &mut graph,
                &g,
                ambient,
                direct_image,
                coarse,
                &Coarse { albedo: depth, normal, depth },
                &choices,
            );
            let [total, indirect, open] = read(gpu, graph, [sum.total, sum.indirect, sum.accessibility]);
            for y in 0..height {
                for x in 0..width {
                    let i = y * width + x;
                    let (cx, cy) = ((x as f64 + 0.5) / 2.0 - 0.5, (y as f64 + 0.5) / 2.0 - 0.5);
                    let corner = |dx: f64, dy: f64| {
                        let x = (cx.floor() + dx).clamp(0.0, cw as f64 - 1.0) as usize;
                        let y = (cy.floor() + dy).clamp(0.0, ch as f64 - 1.0) as usize;
                        y * cw + x
                    };
                    let four = [corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0), corner(1.0, 1.0)];
                    let channel = |c: usize| {
                        let samples = four.map(|j| {
                            let step = (fine.depth[i] - f64::from(coarse_depth[j])).abs();
                            let off = if plane { step / fine.depth[i] } else { step };
                            Some((f64::from(gathered[j][c]), off))
                        });
                        cpu::upsample(samples, cx - cx.floor(), cy - cy.floor(), 1e-3)
                    };
                    let light = dvec3(channel(0), channel(1), channel(2));
                    let accessible = 1.0 - channel(3).clamp(0.0, 1.0);
                    let direct = dvec3(direct[i][0].into(), direct[i][1].into(), direct[i][2].into());
                    let expected = if tint {
                        let reflected = fine.albedo[i] + mirror(i);
                        let around = reflected * 0.4 * (accessible + 1.0 - 0.6).clamp(0.0, 1.0);
                        direct + around + light * reflected * 0.7
                    } else {
                        cpu::sum(direct, accessible, light, 0.6, 0.7)
                    };
                    for c in 0..3 {
                        assert!(
                            (f64::from(total[i][c]) - expected[c]).abs() < 2e-3,
                            "({x}, {y}): {:?} {expected}",
                            total[i]
                        );
                    }
                    assert!((f64::from(open[i][0]) - accessible).abs() < 1e-3);
                    assert!(indirect[i][0] <= total[i][0] + 1e-3);
                }
            }
        }
    });
}

#[test]
fn upsampling_falls_back_to_the_nearest_in_depth() {
    with_gpu(|gpu| {
        let eye = Eye::look_at(DVec3::ZERO, -DVec3::Z, 0.9, 10.0, 4, 4);
        let fine = Buffers {
            width: 4,
            height: 4,
            depth: vec![0.2; 16],
            albedo: vec![DVec3::ONE; 16],
            mask: vec![1.0; 16],
            normal: vec![DVec3::Z; 16],
            sender: vec![DVec3::ZERO; 16],
            factor: 1.0,
        };
        let mut graph = Graph::new("fallback");
        let g = gbuffer(&mut graph, &eye, &fine);
        let ambient = Irradiance::default().upload(&mut graph);
        // No coarse texel is near 0.2; 0.5 is the nearest.
        let extent = Extent::new(2, 2);
        let depth = image(&mut graph, "depth", extent, &[[0.7; 4], [0.5; 4], [0.9; 4], [1.0; 4]]);
        let normal = image(&mut graph, "normal", extent, &[[0.0, 0.0, 1.0, 0.0]; 4]);
        let values = [[1.0, 0.0, 0.0, 0.0], [2.0, 0.0, 0.0, 0.0], [3.0, 0.0, 0.0, 0.0], [4.0, 0.0, 0.0, 0.0]];
        let coarse = image(&mut graph, "gathered", extent, &values);
        let direct = image(&mut graph, "direct", Extent::new(4, 4), &[[0.0; 4]; 16]);
        let choices = Compose {
            factor: 2,
            plane: false,
            epsilon: 1e-3,
            tint: false,
            occlude_ambient: false,
            k_ssao: 0.5,
            k_isr: 1.0,
            area: None,
        };
        let sum =
            compose::sum(&mut graph, &g, ambient, direct, coarse, &Coarse { albedo: depth, normal, depth }, &choices);
        let [total] = read(gpu, graph, [sum.total]);
        // The four middle pixels lie between all four coarse texels.
        for i in [5, 6, 9, 10] {
            assert_eq!(total[i][0], 2.0, "pixel {i}");
        }
    });
}

#[test]
fn upsampling_takes_from_what_faces_alike() {
    with_gpu(|gpu| {
        let eye = Eye::look_at(DVec3::ZERO, -DVec3::Z, 0.9, 10.0, 4, 4);
        let fine = Buffers {
            width: 4,
            height: 4,
            depth: vec![0.2; 16],
            albedo: vec![DVec3::ONE; 16],
            mask: vec![1.0; 16],
            normal: vec![DVec3::Z; 16],
            sender: vec![DVec3::ZERO; 16],
            factor: 1.0,
        };
        let mut graph = Graph::new("normals");
        let g = gbuffer(&mut graph, &eye, &fine);
        let ambient = Irradiance::default().upload(&mut graph);
        let extent = Extent::new(2, 2);
        // All coarse texels lie in the pixels' plane. Means of normals are shorter than one.
        let cosines = [1.0f64, 0.8, 0.6, -1.0];
        let normals = cosines.map(|c| [0.5 * (1.0 - c * c).sqrt() as f32, 0.0, 0.5 * c as f32, 0.0]);
        let depth = image(&mut graph, "depth", extent, &[[0.2; 4]; 4]);
        let normal = image(&mut graph, "normal", extent, &normals);
        let values = [1.0f32, 2.0, 4.0, 8.0];
        let coarse = image(&mut graph, "gathered", extent, &values.map(|v| [v, 0.0, 0.0, 0.0]));
        let direct = image(&mut graph, "direct", Extent::new(4, 4), &[[0.0; 4]; 16]);
        let choices = Compose {
            factor: 2,
            plane: true,
            epsilon: 1e-3,
            tint: false,
            occlude_ambient: false,
            k_ssao: 0.5,
            k_isr: 1.0,
            area: None,
        };
        let sum =
            compose::sum(&mut graph, &g, ambient, direct, coarse, &Coarse { albedo: depth, normal, depth }, &choices);
        let [total] = read(gpu, graph, [sum.total]);
        for (x, y) in [(1, 1), (2, 1), (1, 2), (2, 2)] {
            let (fx, fy) = (if x == 1 { 0.25 } else { 0.75 }, if y == 1 { 0.25 } else { 0.75 });
            let bilinear = [(1.0 - fx) * (1.0 - fy), fx * (1.0 - fy), (1.0 - fx) * fy, fx * fy];
            // Bilinear times the fourth power of the cosine; nothing from behind.
            let weights: Vec<f64> = bilinear.iter().zip(cosines).map(|(b, c)| b * c.max(0.0).powi(4)).collect();
            let weighted: f64 = weights.iter().zip(values).map(|(w, v)| w * f64::from(v)).sum();
            let (expected, found) = (weighted / weights.iter().sum::<f64>(), f64::from(total[y * 4 + x][0]));
            assert!((found - expected).abs() < 2e-3 * expected, "({x}, {y}): {found} instead of {expected}");
        }
    });
}

#[test]
fn direct_light_by_the_inverse_square_and_by_equation_16() {
    with_gpu(|gpu| {
        let (eye, patches) = scene(32, 24);
        let mut fine = Buffers::cast(&eye, &patches, 1);
        fine.albedo.fill(dvec3(0.8, 0.4, 0.2));
        fine.sender.fill(DVec3::ZERO);
        let lamp = vec3(0.4, 1.2, -0.3);
        let light_with = |paper_law: bool, intensity: Vec3, kinds: &[shaders::types::Light]| {
            let mut graph = Graph::new("direct");
            let g = gbuffer(&mut graph, &eye, &fine);
            let mut all = vec![point(lamp, intensity)];
            all.extend_from_slice(kinds);
            let lights = lights(&mut graph, &all);
            let choices =
                Direct { paper_law, specular: false, light_radius: 2.0, light_power: 0.9, ..Direct::default() };
            let lit = direct::light(&mut graph, &g, lights, &choices);
            read(gpu, graph, [lit.direct, lit.diffuse])
        };
        let expect = |paper_law: bool, x: usize, y: usize| {
            let i = fine.at(x, y);
            if fine.depth[i] >= 1.0 {
                return DVec3::ZERO;
            }
            let to = lamp.as_dvec3() - fine.position(&eye, x, y);
            let cosine = fine.normal[i].dot(to.normalize()).max(0.0);
            let arriving = if paper_law {
                // Colours relative to the brightest channel of the brightest light.
                DVec3::new(1.0, 0.5, 0.25) * 0.9 * cpu::paper_attenuation(to.length(), 2.0)
            } else {
                DVec3::new(8.0, 4.0, 2.0) / to.length_squared() / PI
            };
            arriving * cosine * fine.albedo[i]
        };
        for paper_law in [false, true] {
            let [found, diffuse] = light_with(paper_law, vec3(8.0, 4.0, 2.0), &[]);
            assert_eq!(found, diffuse);
            let expected: Vec<[f32; 4]> = (0..24)
                .flat_map(|y| (0..32).map(move |x| (x, y)))
                .map(|(x, y)| expect(paper_law, x, y).as_vec3().extend(1.0).to_array())
                .collect();
            assert!(expected.iter().any(|e| e[0] > 0.1));
            close(&found, &expected, 0..3, 1e-3, 3e-3);
        }
        // Twice the light, twice the radiance; no light, none.
        let [once, _] = light_with(false, vec3(8.0, 4.0, 2.0), &[]);
        let [twice, _] = light_with(false, vec3(16.0, 8.0, 4.0), &[]);
        let doubled: Vec<[f32; 4]> = once.iter().map(|t| t.map(|c| 2.0 * c)).collect();
        close(&twice, &doubled, 0..3, 1e-4, 2e-3);
        let [none, _] = light_with(false, Vec3::ZERO, &[]);
        assert!(none.iter().all(|t| t[..3] == [0.0; 3]));
        // A directional light adds E ρ cos / π.
        let sun = shaders::types::Light {
            kind: shaders::consts::LIGHT_DIRECTIONAL,
            direction: [0.0, -0.6, -0.8],
            intensity: [3.0; 3],
            spot_offset: 1.0,
            ..Default::default()
        };
        let [sunny, _] = light_with(false, Vec3::ZERO, &[sun]);
        for (i, t) in sunny.iter().enumerate().filter(|(i, _)| fine.depth[*i] < 1.0) {
            let cosine = fine.normal[i].dot(dvec3(0.0, 0.6, 0.8)).max(0.0);
            assert!((f64::from(t[0]) - 3.0 * 0.8 * cosine / PI).abs() < 2e-3, "texel {i}: {t:?}");
        }
    });
}
