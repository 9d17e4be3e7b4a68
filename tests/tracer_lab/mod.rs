//! Small scenes, statistics, and reading of pictures, for the tests of the path tracer.
#![allow(dead_code)]

use glam::{Mat4, Vec3, Vec4};
use lucerna::{
    gpu::Gpu,
    image::Layers,
    scene::{Camera, Light, LightKind, Material, Mesh, Node, Pose, Primitive, Projection, Scene, Transform, View},
    tracer::{Filter, Settings, Tracer},
};

/// Builds scenes of a few triangles.
#[derive(Default)]
pub struct Stage {
    pub scene: Scene,
}

impl Stage {
    pub fn new() -> Self {
        Self::default()
    }

    pub fn material(&mut self, material: Material) -> u32 {
        self.scene.materials.push(material);
        self.scene.materials.len() as u32 - 1
    }

    /// Black but for what it emits, without gloss.
    pub fn emitter(&mut self, radiance: Vec3) -> u32 {
        self.material(Material::emitter("emitter", radiance))
    }

    /// Triangles with these normals; positions are in metres.
    pub fn mesh(&mut self, material: u32, positions: Vec<Vec3>, normals: Vec<Vec3>, indices: Vec<u32>) -> usize {
        let primitive = Primitive {
            tangents: vec![Vec4::ZERO; positions.len()],
            positions,
            normals,
            indices,
            material,
            ..Primitive::default()
        };
        self.scene.meshes.push(Mesh { primitives: vec![primitive], ..Mesh::default() });
        let mesh = Some(self.scene.meshes.len() as u32 - 1);
        self.scene.nodes.push(Node { mesh, ..Node::default() });
        self.scene.nodes.len() - 1
    }

    /// Corner and two sides; its front looks along side a × side b.
    pub fn quad(&mut self, material: u32, corner: Vec3, a: Vec3, b: Vec3) -> usize {
        let positions = vec![corner, corner + a, corner + a + b, corner + b];
        self.mesh(material, positions, vec![a.cross(b).normalize(); 4], vec![0, 1, 2, 0, 2, 3])
    }

    /// A box seen from the outside (`inside`: from within).
    pub fn cuboid(&mut self, material: u32, low: Vec3, high: Vec3, inside: bool) {
        let size = high - low;
        for axis in 0..3 {
            let unit = |i: usize| Vec3::from_array(std::array::from_fn(|k| if k == i % 3 { size[k] } else { 0.0 }));
            let (a, b) = (unit(axis + 1), unit(axis + 2));
            for upper in [false, true] {
                let corner = if upper { low + unit(axis) } else { low };
                // a × b looks along the axis: out of the upper side.
                let (a, b) = if upper != inside { (a, b) } else { (b, a) };
                self.quad(material, corner, a, b);
            }
        }
    }

    /// A sphere of triangles with smooth normals.
    pub fn sphere(&mut self, material: u32, centre: Vec3, radius: f32, rings: u32, inside: bool) {
        let segments = 2 * rings;
        let (mut positions, mut normals, mut indices) = (vec![], vec![], vec![]);
        for ring in 0..=rings {
            let polar = std::f32::consts::PI * ring as f32 / rings as f32;
            for segment in 0..=segments {
                let azimuth = 2.0 * std::f32::consts::PI * segment as f32 / segments as f32;
                let n = Vec3::new(polar.sin() * azimuth.sin(), polar.cos(), polar.sin() * azimuth.cos());
                positions.push(centre + radius * n);
                normals.push(if inside { -n } else { n });
            }
        }
        for ring in 0..rings {
            for segment in 0..segments {
                let at = ring * (segments + 1) + segment;
                let below = at + segments + 1;
                let mut add = |a: u32, b: u32, c: u32| indices.extend(if inside { [a, c, b] } else { [a, b, c] });
                if ring > 0 {
                    add(at, below, at + 1);
                }
                if ring + 1 < rings {
                    add(at + 1, below, below + 1);
                }
            }
        }
        self.mesh(material, positions, normals, indices);
    }

    pub fn light(&mut self, kind: LightKind, color: Vec3, intensity: f32, world: Mat4) {
        self.scene.lights.push(Light { name: String::new(), kind, color, intensity });
        let light = Some(self.scene.lights.len() as u32 - 1);
        self.scene.nodes.push(Node { light, local: Transform::Matrix(world), ..Node::default() });
    }

    pub fn point(&mut self, at: Vec3, intensity: Vec3) {
        self.light(LightKind::Point { range: None }, intensity, 1.0, Mat4::from_translation(at));
    }
}

/// A camera without perspective that sees `size` metres of height.
pub fn flat_view(from: Vec3, to: Vec3, size: f32, extent: [u32; 2]) -> View {
    let projection = Projection::Orthographic { xmag: 0.5 * size, ymag: 0.5 * size, znear: 0.0, zfar: 100.0 };
    looking(projection, from, to, extent)
}

/// A camera with perspective; `degrees` of height.
pub fn view(from: Vec3, to: Vec3, degrees: f32, extent: [u32; 2]) -> View {
    let projection = Projection::Perspective { yfov: degrees.to_radians(), aspect: None, znear: 0.001, zfar: None };
    looking(projection, from, to, extent)
}

fn looking(projection: Projection, from: Vec3, to: Vec3, extent: [u32; 2]) -> View {
    let up = if (to - from).normalize().y.abs() > 0.99 { Vec3::Z } else { Vec3::Y };
    let back = (from - to).normalize();
    let right = up.cross(back).normalize();
    let axes = [right, back.cross(right), back].map(|axis| axis.extend(0.0));
    let world_from_camera = Mat4::from_cols(axes[0], axes[1], axes[2], from.extend(1.0));
    View::new(&Camera { name: String::new(), projection }, world_from_camera, extent)
}

/// Direct light by Lambert's law alone, rays through the centres.
pub fn matt(bounces: u32) -> Settings {
    Settings { bounces, diffuse_only: true, filter: Filter::Centre, ..Settings::default() }
}

pub fn render(gpu: &Gpu, scene: &Scene, view: &View, settings: &Settings, samples: u32) -> Layers {
    let pose = Pose::rest(scene);
    let mut tracer = Tracer::new(gpu, scene, &pose).unwrap();
    let layers = tracer.render(view, settings, samples).unwrap();
    assert_eq!(tracer.sums().unwrap().lost(), 0, "samples that are no numbers");
    layers
}

/// Mean of a layer over the picture, for each of three channels.
pub fn mean(layers: &Layers, name: &str) -> [f64; 3] {
    let layer = layers.layer(name).unwrap_or_else(|| panic!("no layer {name:?}"));
    let count = (layer.data.len() / layer.channels.len()) as f64;
    [0, 1, 2].map(|c| {
        let channel = layer.data.iter().skip(c % layer.channels.len()).step_by(layer.channels.len());
        channel.map(|&v| f64::from(v)).sum::<f64>() / count
    })
}

/// Standard deviation of the mean luminance of the picture, from the layer of variances.
pub fn deviation(layers: &Layers) -> f64 {
    let variance = &layers.layer("variance").unwrap().data;
    variance.iter().map(|&v| f64::from(v)).sum::<f64>().sqrt() / variance.len() as f64
}

pub fn luminance([r, g, b]: [f64; 3]) -> f64 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

/// Fails if the mean luminance of the picture is further from `expected` than chance explains (4.5 deviations, one in
/// 150 000) and than `slack`, a share of `expected` for what is rounded or tessellated.
#[track_caller]
pub fn expect_mean(layers: &Layers, expected: f64, slack: f64) {
    let (found, sigma) = (luminance(mean(layers, "")), deviation(layers));
    let allowed = 4.5 * sigma + slack * expected;
    assert!((found - expected).abs() <= allowed, "{found} instead of {expected} (σ {sigma}, slack {slack})");
    assert!(sigma < 0.05 * expected.max(1e-9), "too noisy to say anything: {found} ± {sigma}");
}

/// Survival function of the chi-square distribution: the regularised upper incomplete gamma function Q(k/2, x/2)
/// (series and continued fraction as in Numerical Recipes, 6.2).
pub fn chi_square_tail(x: f64, freedom: f64) -> f64 {
    let (a, x) = (0.5 * freedom, 0.5 * x);
    let front = (a * x.ln() - x - ln_gamma(a)).exp();
    if x < a + 1.0 {
        let (mut term, mut sum) = (1.0 / a, 1.0 / a);
        for n in 1..10_000 {
            term *= x / (a + f64::from(n));
            sum += term;
            if term < sum * 1e-15 {
                break;
            }
        }
        return 1.0 - sum * front;
    }
    let mut b = x + 1.0 - a;
    let mut c = 1e300;
    let mut d = 1.0 / b;
    let mut h = d;
    for i in 1..10_000 {
        let an = -f64::from(i) * (f64::from(i) - a);
        b += 2.0;
        d = 1.0 / (an * d + b);
        c = b + an / c;
        let step = d * c;
        h *= step;
        if (step - 1.0).abs() < 1e-15 {
            break;
        }
    }
    front * h
}

/// Lanczos' approximation.
fn ln_gamma(x: f64) -> f64 {
    const C: [f64; 6] = [
        76.180_091_729_471_46,
        -86.505_320_329_416_77,
        24.014_098_240_830_91,
        -1.231_739_572_450_155,
        0.120_865_097_386_617_9e-2,
        -0.539_523_938_495_3e-5,
    ];
    let base = x + 5.5;
    let series: f64 = 1.000_000_000_190_015 + C.iter().enumerate().map(|(i, c)| c / (x + 1.0 + i as f64)).sum::<f64>();
    (x + 0.5) * base.ln() - base + (2.506_628_274_631_000_5 * series / x).ln()
}

/// p-value of `counts` against `expected`, bins pooled to at least five expected.
pub fn chi_square(counts: &[f64], expected: &[f64]) -> f64 {
    let mut order: Vec<usize> = (0..counts.len()).collect();
    order.sort_by(|&a, &b| expected[a].total_cmp(&expected[b]));
    let (mut statistic, mut bins, mut pool) = (0.0, 0u32, (0.0, 0.0));
    for i in order {
        if expected[i] == 0.0 {
            assert_eq!(counts[i], 0.0, "samples where the density is 0 (bin {i})");
            continue;
        }
        pool = (pool.0 + counts[i], pool.1 + expected[i]);
        if pool.1 >= 5.0 {
            statistic += (pool.0 - pool.1) * (pool.0 - pool.1) / pool.1;
            bins += 1;
            pool = (0.0, 0.0);
        }
    }
    chi_square_tail(statistic, f64::from(bins.max(2) - 1))
}

/// Level for each of `runs` tests that together fail by chance once in a hundred times (Šidák).
pub fn sidak(runs: u32) -> f64 {
    1.0 - (1.0f64 - 0.01).powf(1.0 / f64::from(runs))
}
