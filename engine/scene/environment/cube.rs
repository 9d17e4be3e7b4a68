//! Cubes and their conversion to and from latitude-longitude images.

use glam::{Vec2, Vec3};

use super::{Environment, direction_from_uv};

/// Samples a side and pixel when resampling: enough that edges are smooth and that the sum of the light is kept.
const SUBSAMPLES: u32 = 2;

/// A face as seen from the inside. The names are those of the usual file names; the front, `pz`, looks down −Z, so that
/// a cross with it in the middle shows the same view as the centre of a latitude-longitude image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Face {
    Px,
    Nx,
    Py,
    Ny,
    Pz,
    Nz,
}

impl Face {
    /// In the order of strips and of Vulkan cube images.
    pub const ALL: [Self; 6] = [Self::Px, Self::Nx, Self::Py, Self::Ny, Self::Pz, Self::Nz];

    /// World-space directions: into the face, to the right in its picture, and down in its picture.
    pub fn axes(self) -> [Vec3; 3] {
        match self {
            Self::Px => [Vec3::X, Vec3::Z, Vec3::NEG_Y],
            Self::Nx => [Vec3::NEG_X, Vec3::NEG_Z, Vec3::NEG_Y],
            Self::Py => [Vec3::Y, Vec3::X, Vec3::NEG_Z],
            Self::Ny => [Vec3::NEG_Y, Vec3::X, Vec3::Z],
            Self::Pz => [Vec3::NEG_Z, Vec3::X, Vec3::NEG_Y],
            Self::Nz => [Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y],
        }
    }

    /// Direction (not normalised) of a point of the face, `st` in [0, 1]² from its top left corner.
    pub fn direction(self, st: Vec2) -> Vec3 {
        let [forward, right, down] = self.axes();
        forward + right * (2.0 * st.x - 1.0) + down * (2.0 * st.y - 1.0)
    }

    /// The face that a direction meets, and where.
    pub fn of(direction: Vec3) -> (Self, Vec2) {
        let a = direction.abs();
        let face = if a.x >= a.y && a.x >= a.z {
            if direction.x >= 0.0 { Self::Px } else { Self::Nx }
        } else if a.y >= a.z {
            if direction.y >= 0.0 { Self::Py } else { Self::Ny }
        } else if direction.z < 0.0 {
            Self::Pz
        } else {
            Self::Nz
        };
        let [forward, right, down] = face.axes();
        let depth = direction.dot(forward);
        (face, Vec2::new(direction.dot(right), direction.dot(down)) / depth * 0.5 + 0.5)
    }
}

/// Six square faces of radiance, W/(sr·m²).
#[derive(Clone, Debug, PartialEq)]
pub struct Cube {
    /// Pixels a side.
    pub size: u32,
    /// In the order of [`Face::ALL`], top row first.
    pub faces: [Vec<Vec3>; 6],
    /// Whether the outer pixels have their centres on the edges of the cube (OpenEXR) and not half a pixel inside.
    pub edge_centred: bool,
}

impl Cube {
    /// Direction (not normalised) of the centre of a pixel.
    pub fn direction(&self, face: Face, x: u32, y: u32) -> Vec3 {
        face.direction(self.st(Vec2::new(x as f32, y as f32)))
    }

    /// From pixel indices to [0, 1]².
    fn st(&self, pixel: Vec2) -> Vec2 {
        if self.edge_centred { pixel / (self.size.max(2) - 1) as f32 } else { (pixel + 0.5) / self.size as f32 }
    }

    /// Solid angle in steradians of a pixel of a face: exact differences of Ω(x, y) = atan(xy / √(x² + y² + 1)).
    pub fn solid_angle(&self, x: u32, y: u32) -> f64 {
        let bound = |i: u32| {
            let t = if self.edge_centred {
                (f64::from(i) - 0.5) / f64::from(self.size.max(2) - 1)
            } else {
                f64::from(i) / f64::from(self.size)
            };
            2.0 * t.clamp(0.0, 1.0) - 1.0
        };
        let corner = |x: f64, y: f64| (x * y).atan2((x * x + y * y + 1.0).sqrt());
        let ([x0, x1], [y0, y1]) = ([bound(x), bound(x + 1)], [bound(y), bound(y + 1)]);
        corner(x0, y0) - corner(x0, y1) - corner(x1, y0) + corner(x1, y1)
    }

    /// Bilinear radiance; at the outer half pixel of a face its edge is repeated.
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        let (face, st) = Face::of(direction);
        let last = (self.size.max(1) - 1) as f32;
        let pixel = if self.edge_centred { st * last } else { st * self.size as f32 - 0.5 };
        let pixel = pixel.clamp(Vec2::ZERO, Vec2::splat(last));
        let (low, part) = (pixel.floor(), pixel.fract());
        let high = (low + 1.0).min(Vec2::splat(last));
        let at = |x: f32, y: f32| {
            let index = y as usize * self.size as usize + x as usize;
            self.faces[face as usize].get(index).copied().unwrap_or_default()
        };
        let top = at(low.x, low.y).lerp(at(high.x, low.y), part.x);
        top.lerp(at(low.x, high.y).lerp(at(high.x, high.y), part.x), part.y)
    }

    /// Mean radiance over the sphere, W/(sr·m²).
    pub fn mean(&self) -> Vec3 {
        let mut sum = glam::DVec3::ZERO;
        for pixels in &self.faces {
            for (i, pixel) in pixels.iter().enumerate() {
                let i = i as u32;
                sum += pixel.as_dvec3() * self.solid_angle(i % self.size, i / self.size);
            }
        }
        (sum / (4.0 * std::f64::consts::PI)).as_vec3()
    }

    /// Resampled to a latitude-longitude image of `4 size × 2 size` pixels: about one pixel a pixel on the horizon.
    pub fn to_latlong(&self, name: impl Into<String>) -> Environment {
        let (width, height) = (4 * self.size, 2 * self.size);
        let mut pixels = Vec::with_capacity(width as usize * height as usize);
        for y in 0..height {
            for x in 0..width {
                let sum: Vec3 = subsamples()
                    .map(|s| {
                        let uv = (Vec2::new(x as f32, y as f32) + s) / Vec2::new(width as f32, height as f32);
                        self.radiance(direction_from_uv(uv))
                    })
                    .sum();
                pixels.push(sum / (SUBSAMPLES * SUBSAMPLES) as f32);
            }
        }
        Environment { name: name.into(), width, height, pixels, rotation: 0.0, scale: 1.0 }
    }

    /// Resampled from an environment, with its rotation and scale.
    pub fn from_environment(environment: &Environment, size: u32) -> Self {
        let faces = Face::ALL.map(|face| {
            let texel = |x: u32, y: u32| {
                let sum: Vec3 = subsamples()
                    .map(|s| {
                        let st = (Vec2::new(x as f32, y as f32) + s) / size as f32;
                        environment.radiance(face.direction(st))
                    })
                    .sum();
                sum / (SUBSAMPLES * SUBSAMPLES) as f32
            };
            (0..size).flat_map(|y| (0..size).map(move |x| (x, y))).map(|(x, y)| texel(x, y)).collect()
        });
        Self { size, faces, edge_centred: false }
    }
}

/// Points of a regular grid inside a pixel.
fn subsamples() -> impl Iterator<Item = Vec2> {
    let at = |i: u32| (i as f32 + 0.5) / SUBSAMPLES as f32;
    (0..SUBSAMPLES * SUBSAMPLES).map(move |i| Vec2::new(at(i % SUBSAMPLES), at(i / SUBSAMPLES)))
}
