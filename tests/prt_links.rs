//! Links: light of samples that see much of each other, beside the vectors.

use crate::{
    prt_lab::{baked, closed, small},
    prt_light::room,
    tracer_lab::Stage,
};
use glam::{Vec3, vec3};
use lucerna::{
    Stop,
    gpu::{DeviceKind, Gpu, testing::with_gpu},
    scene::{Material, Mesh, Node, Primitive, Scene},
    shaders::types::PrtPoint,
    techniques::prt::{
        Baking, Settings, Stored,
        check::{CheckOptions, RelativeError, at_samples, check},
        solve,
    },
};

const PLACES: [[f32; 3]; 2] = [[-1.2, 0.5, 0.9], [1.6, 2.1, -1.1]];

fn diffuse(linked: u32) -> Settings {
    Settings { gloss: false, linked, ..Settings::default() }
}

/// Root of the mean of squares, over samples with their areas.
fn norm(stored: &Stored, of: impl Fn(usize) -> f32) -> f64 {
    let square = |(i, area): (usize, f32)| f64::from(area) * f64::from(of(i)).powi(2);
    stored.samples.iter().map(|sample| sample.area).enumerate().map(square).sum::<f64>().sqrt()
}

#[test]
fn light_through_links_is_that_of_the_slow_twin() {
    with_gpu(|gpu| {
        let scene = room();
        let stored = baked(gpu, &scene, &Baking { samples: 1000, rays: 128, links: 0.02, ..small() });
        let links: usize = stored.transfers.iter().map(|of| of.links.senders.len()).sum();
        assert!(links > stored.samples.len(), "{links}");
        let albedo = |material: u32| scene.materials[material as usize].base_color.truncate().to_array();
        let albedos: Vec<_> = stored.samples.iter().map(|sample| albedo(sample.material)).collect();
        let mut before: Vec<Vec<[f32; 3]>> = Vec::new();
        for (linked, bounces) in [(0, true), (1, true), (3, true), (3, false)] {
            let settings = Settings { bounces, ..diffuse(linked) };
            let found = at_samples(gpu, &scene, &stored, &settings, &PLACES).unwrap();
            let solved = solve::solve(&stored, &albedos, &settings).unwrap();
            for [direct, indirect] in &found {
                let twin = solved.indirect(&stored, &albedos, direct);
                for channel in 0..3 {
                    let off = norm(&stored, |i| indirect[i][channel] - twin[i][channel]);
                    assert!(off < 1e-4 * norm(&stored, |i| twin[i][channel]), "{linked} {bounces} {channel}: {off}");
                }
            }
            // Each number of scatterings has light of its own.
            let first = found[0][1].clone();
            assert!(!before.contains(&first), "{linked} {bounces}");
            before.push(first);
        }
    });
}

#[test]
fn scatterings_through_links_come_to_an_end() {
    with_gpu(|gpu| {
        let stored = baked(gpu, &room(), &Baking { samples: 800, rays: 128, light: 2, receivers: 4, ..small() });
        let count = stored.samples.len();
        let albedos = vec![[0.5; 3]; count];
        let direct: Vec<[f32; 3]> = (0..count).map(|i| [f32::from(i % 7 == 0); 3]).collect();
        let of = |linked| solve::indirect(&stored, &albedos, &direct, &diffuse(linked)).unwrap();
        let last = of(16);
        let whole = norm(&stored, |i| last[i][0]);
        let off = [1, 2, 4, 15].map(|linked| {
            let found = of(linked);
            norm(&stored, |i| found[i][0] - last[i][0]) / whole
        });
        assert!(off.is_sorted_by(|a, b| a > b) && off[3] < 1e-3, "{off:?}");
    });
}

/// A room with a row of 24 boxes like books of four colours. They are one mesh of one material, and every third one stands out.
fn row() -> Scene {
    let mut scene = room();
    let colors = [vec3(0.85, 0.05, 0.05), vec3(0.05, 0.75, 0.05), vec3(0.05, 0.05, 0.85), vec3(0.8, 0.7, 0.05)];
    let mut row = Primitive { material: scene.materials.len() as u32, ..Primitive::default() };
    scene.materials.push(Material::diffuse("books", Vec3::ONE));
    for book in 0..24 {
        let mut stage = Stage::new();
        let out = if book % 3 == 0 { 0.03 } else { 0.0 };
        let low = vec3(-1.0 + 0.061 * book as f32, 0.0, -1.49);
        stage.cuboid(0, low, low + vec3(0.06, 0.8, 0.3 + out), false);
        for side in stage.scene.meshes.iter().flat_map(|mesh| &mesh.primitives) {
            let first = row.positions.len() as u32;
            row.indices.extend(side.indices.iter().map(|index| first + index));
            row.positions.extend(&side.positions);
            row.normals.extend(&side.normals);
            row.tangents.extend(&side.tangents);
            row.colors.extend(side.positions.iter().map(|_| colors[book % 4].extend(1.0)));
        }
    }
    let mesh = Some(scene.meshes.len() as u32);
    scene.meshes.push(Mesh { primitives: vec![row], ..Mesh::default() });
    scene.nodes.push(Node { mesh, ..Node::default() });
    scene
}

#[test]
fn the_colour_of_a_book_is_not_that_of_its_neighbour() {
    with_gpu(|gpu| {
        let scene = row();
        let mut errors = Vec::new();
        for seed in [0, 1] {
            let stored = baked(gpu, &scene, &Baking { samples: 3000, cluster: 600, rays: 512, seed, ..small() });
            let options = CheckOptions { lights: 16, samples: 3000, paths: 128, seed: 0 };
            let found = check(gpu, &scene, &stored, &diffuse(3), options, &Stop::default()).unwrap();
            // Light from beside a surface is hard for other reasons.
            let far = found.iter().filter(|light| light.distance_to_surface > 0.2);
            errors.extend(far.filter_map(|light| Some(light.transferred?.error)));
        }
        errors.sort_by(f64::total_cmp);
        let median = errors[errors.len() / 2];
        // Samples that know only the material of their surface have 0.040, and rays that do not know which book they meet 0.032.
        assert!(errors.len() > 12 && median < 0.035, "{errors:?}");
    });
}

/// Light that grows along the floor of a closed box, at the walls just above it: the relative error of one scattering.
fn error_above_the_floor(gpu: &Gpu, seed: u32) -> f32 {
    let few = Baking { samples: 600, cluster: 300, light: 64, receivers: 0, rays: 2048, gaps: 1.0, seed, ..small() };
    let stored = baked(gpu, &closed(Vec3::splat(0.5)), &few);
    let floor = |at: Vec3, up: f32| if up > 0.5 { 1.0 + at.x } else { 0.0 };
    let count = stored.samples.len();
    let of = |sample: &PrtPoint| [floor(Vec3::from(sample.position), sample.normal[1]); 3];
    let direct: Vec<[f32; 3]> = stored.samples.iter().map(of).collect();
    let settings = Settings { bounces: false, ..diffuse(1) };
    let found = solve::indirect(&stored, &vec![[1.0; 3]; count], &direct, &settings).unwrap();
    let (mut off, mut whole, mut low) = (0.0f32, 0.0f32, 0);
    for (sample, found) in stored.samples.iter().zip(&found) {
        let (at, normal) = (Vec3::from(sample.position), Vec3::from(sample.normal));
        if normal.y.abs() > 0.5 || at.y > -0.9 {
            continue;
        }
        // Even points of a disc, lifted to directions with the density of the cosine.
        let [side, up] = [normal.cross(Vec3::Y), Vec3::Y];
        let rays = 4096;
        let seen = (0..rays).map(|ray| {
            let (radius, angle) = (((ray as f32 + 0.5) / rays as f32).sqrt(), 2.399_963_2 * ray as f32);
            let [x, y] = [radius * angle.cos(), radius * angle.sin()];
            let way = side * x + up * y + normal * (1.0 - radius * radius).sqrt();
            let hit = at + way * (-(1.0 + at.y) / way.y);
            if way.y < 0.0 && hit.abs().max_element() < 1.0001 { floor(hit, 1.0) } else { 0.0 }
        });
        let truth = seen.sum::<f32>() / rays as f32;
        off += sample.area * (found[0] - truth).powi(2);
        whole += sample.area * truth * truth;
        low += 1;
    }
    assert!(low > 20, "{low}");
    (off / whole).sqrt()
}

#[test]
fn light_goes_smoothly_from_sample_to_sample() {
    with_gpu(|gpu| {
        // Example lights lie on paths of particles, which differ by rounding from device to device, and with them the vectors: eight seeds have 0.014 to 0.028
        // on a CPU driver, and 0.024 to 0.032 with the nearest sample alone. So two seeds, whose mean is 0.0236, are held against the nearest sample alone, with
        // 0.0310, where their lights are known; elsewhere the error may be as large as with any seed.
        let known = gpu.caps().kind == DeviceKind::Cpu;
        let error = [1, 2].map(|seed| error_above_the_floor(gpu, seed)).iter().sum::<f32>() / 2.0;
        assert!(error < if known { 0.027 } else { 0.035 }, "{error}");
    });
}

#[test]
fn links_lower_the_error_of_light_near_surfaces() {
    with_gpu(|gpu| {
        let scene = room();
        let stored = baked(gpu, &scene, &Baking { samples: 2000, cluster: 1000, light: 4, ..small() });
        let options = CheckOptions { lights: 6, samples: 150, paths: 256, seed: 0 };
        let [by_vectors, by_links] = [0, 3].map(|linked| {
            let found = check(gpu, &scene, &stored, &diffuse(linked), options, &Stop::default()).unwrap();
            let errors = |of: fn(&RelativeError) -> f64| {
                let all: Vec<f64> = found.iter().filter_map(|light| Some(of(&light.transferred?))).collect();
                (all.iter().map(|error| error * error).sum::<f64>() / all.len() as f64).sqrt()
            };
            [errors(|of| of.error), errors(|of| of.trimmed)]
        });
        assert!(by_links[0] < by_vectors[0] && by_links[1] < by_vectors[1], "{by_links:?} {by_vectors:?}");
        // The same samples and rays with many more vectors: what is left is the error of the vectors alone.
        let many = baked(gpu, &scene, &Baking { light: 64, receivers: 0, ..stored.plan.settings.clone() });
        assert!(many.samples == stored.samples);
        let albedos = vec![[0.6; 3]; stored.samples.len()];
        let near = |at: Vec3| -> Vec<[f32; 3]> {
            let of = |sample: &PrtPoint| {
                let way = at - Vec3::from(sample.position);
                [Vec3::from(sample.normal).dot(way).max(0.0) / way.length().powi(3); 3]
            };
            stored.samples.iter().map(of).collect()
        };
        let mut sums = [0.0; 2];
        for at in [vec3(-1.8, 1.2, 0.3), vec3(1.7, 0.4, -1.2), vec3(0.0, 2.3, 0.8)] {
            let light = near(at);
            let of = |stored: &Stored, linked| solve::indirect(stored, &albedos, &light, &diffuse(linked)).unwrap();
            let (truth, found) = (of(&many, 16), [0, 3].map(|linked| of(&stored, linked)));
            let whole = norm(&stored, |i| truth[i][0]);
            let [by_vectors, by_links] = found.map(|found| norm(&stored, |i| found[i][0] - truth[i][0]) / whole);
            assert!(by_links < 0.9 * by_vectors, "{at}: {by_links} {by_vectors}");
            sums = [sums[0] + by_links, sums[1] + by_vectors];
        }
        assert!(sums[0] < 0.6 * sums[1], "{sums:?}");
    });
}
