//! Triangles while they are being built: [`Geometry`] of one material, [`Model`] of several.

use glam::{Mat3, Mat4, Vec2, Vec3, Vec4};
use lucerna::scene::Primitive;
use std::collections::HashMap;

/// Triangles of one material. Lists as in [`Primitive`]; `colors` is empty or as long as `positions`.
#[derive(Clone, Debug, Default)]
pub(crate) struct Geometry {
    pub positions: Vec<Vec3>,
    pub normals: Vec<Vec3>,
    /// Metres of surface, v downwards.
    pub uvs: Vec<Vec2>,
    pub colors: Vec<Vec4>,
    pub indices: Vec<u32>,
}

impl Geometry {
    /// Adds a vertex and returns its index.
    pub fn vertex(&mut self, position: Vec3, normal: Vec3, uv: Vec2) -> u32 {
        self.positions.push(position);
        self.normals.push(normal);
        self.uvs.push(uv);
        (self.positions.len() - 1) as u32
    }

    /// Adds a triangle, unless it has no area (the poles of surfaces of revolution).
    pub fn triangle(&mut self, a: u32, b: u32, c: u32) {
        let [pa, pb, pc] = [a, b, c].map(|i| self.positions[i as usize]);
        let longest = (pb - pa).length_squared().max((pc - pb).length_squared()).max((pa - pc).length_squared());
        if (pb - pa).cross(pc - pa).length() > 2e-5 * longest {
            self.indices.extend([a, b, c]);
        }
    }

    /// Adds the quad a, b, c, d (in order around it) as two triangles.
    pub fn quad(&mut self, a: u32, b: u32, c: u32, d: u32) {
        self.triangle(a, b, c);
        self.triangle(a, c, d);
    }

    /// Adds a flat quad with corners counter-clockwise from bottom left; its uv spans metres from the bottom left.
    pub fn flat_quad(&mut self, corners: [Vec3; 4]) {
        let [a, b, c, d] = corners;
        let normal = (c - a).cross(d - b).normalize_or(Vec3::Y);
        let (right, up) = ((b - a).length(), (d - a).length());
        let ids = [
            self.vertex(a, normal, Vec2::ZERO),
            self.vertex(b, normal, Vec2::new(right, 0.0)),
            self.vertex(c, normal, Vec2::new(right, -up)),
            self.vertex(d, normal, Vec2::new(0.0, -up)),
        ];
        self.quad(ids[0], ids[1], ids[2], ids[3]);
    }

    /// Adds a flat triangle, uv in metres in its plane.
    pub fn flat_triangle(&mut self, a: Vec3, b: Vec3, c: Vec3) {
        let normal = (b - a).cross(c - a).normalize_or(Vec3::Y);
        let u_axis = (b - a).normalize_or(Vec3::X);
        let v_axis = u_axis.cross(normal);
        let ids = [a, b, c].map(|p| self.vertex(p, normal, Vec2::new((p - a).dot(u_axis), (p - a).dot(v_axis))));
        self.triangle(ids[0], ids[1], ids[2]);
    }

    /// Adds a copy of another geometry.
    pub fn append(&mut self, other: &Self) {
        let base = self.positions.len() as u32;
        if !other.colors.is_empty() || !self.colors.is_empty() {
            self.colors.resize(base as usize, Vec4::ONE);
            self.colors.extend(&other.colors);
            self.colors.resize(base as usize + other.positions.len(), Vec4::ONE);
        }
        self.positions.extend(&other.positions);
        self.normals.extend(&other.normals);
        self.uvs.extend(&other.uvs);
        self.indices.extend(other.indices.iter().map(|i| i + base));
    }

    /// Moved by an affine map; a mirroring one turns the winding so that the outside stays outside.
    #[must_use]
    pub fn transformed(mut self, map: Mat4) -> Self {
        let normal_map = Mat3::from_mat4(map).inverse().transpose();
        for position in &mut self.positions {
            *position = map.transform_point3(*position);
        }
        for normal in &mut self.normals {
            *normal = (normal_map * *normal).normalize_or(Vec3::Y);
        }
        if map.determinant() < 0.0 {
            for corners in self.indices.chunks_exact_mut(3) {
                corners.swap(1, 2);
            }
        }
        self
    }

    /// Moved by (x, y, z).
    #[must_use]
    pub fn at(self, x: f32, y: f32, z: f32) -> Self {
        self.transformed(Mat4::from_translation(Vec3::new(x, y, z)))
    }

    /// Turned about +Y by degrees, counter-clockwise seen from above.
    #[must_use]
    pub fn turned_y(self, degrees: f32) -> Self {
        self.transformed(Mat4::from_rotation_y(degrees.to_radians()))
    }

    /// Turned about +X by degrees.
    #[must_use]
    pub fn turned_x(self, degrees: f32) -> Self {
        self.transformed(Mat4::from_rotation_x(degrees.to_radians()))
    }

    /// Turned about +Z by degrees.
    #[must_use]
    pub fn turned_z(self, degrees: f32) -> Self {
        self.transformed(Mat4::from_rotation_z(degrees.to_radians()))
    }

    /// All vertices of one linear colour.
    #[must_use]
    pub fn colored(mut self, color: Vec3) -> Self {
        self.colors = vec![color.extend(1.0); self.positions.len()];
        self
    }

    /// Turned inside out: for rooms seen from within.
    #[must_use]
    pub fn flipped(mut self) -> Self {
        for normal in &mut self.normals {
            *normal = -*normal;
        }
        for corners in self.indices.chunks_exact_mut(3) {
            corners.swap(1, 2);
        }
        self
    }

    /// Positions mapped by a function, normals made smooth again over vertices at equal places.
    #[must_use]
    pub fn displaced(mut self, map: impl Fn(Vec3) -> Vec3) -> Self {
        for position in &mut self.positions {
            *position = map(*position);
        }
        self.smooth_normals();
        self
    }

    /// Normals from the triangles around each place, weighted by angle.
    pub fn smooth_normals(&mut self) {
        let mut sums: HashMap<[i32; 3], Vec3> = HashMap::new();
        for corners in self.indices.chunks_exact(3) {
            let p = [0, 1, 2].map(|k| self.positions[corners[k] as usize]);
            let normal = (p[1] - p[0]).cross(p[2] - p[0]).normalize_or_zero();
            for k in 0..3 {
                let angle = (p[(k + 1) % 3] - p[k]).angle_between(p[(k + 2) % 3] - p[k]);
                *sums.entry(place(p[k])).or_default() += normal * angle;
            }
        }
        for (position, normal) in self.positions.iter().zip(&mut self.normals) {
            if let Some(sum) = sums.get(&place(*position)) {
                *normal = sum.normalize_or(*normal);
            }
        }
    }

    /// As a scene primitive with the given material, without tangents.
    pub fn into_primitive(self, material: u32) -> Primitive {
        Primitive {
            tangents: vec![Vec4::ZERO; self.positions.len()],
            positions: self.positions,
            normals: self.normals,
            uvs: vec![self.uvs],
            colors: self.colors,
            indices: self.indices,
            material,
            ..Primitive::default()
        }
    }
}

/// A place on a lattice of a hundredth of a millimetre: vertices that share it are one point of the surface.
pub(crate) fn place(position: Vec3) -> [i32; 3] {
    (position * 1e5).round().as_ivec3().to_array()
}

/// Geometry of several materials, in order of first use.
#[derive(Clone, Debug, Default)]
pub(crate) struct Model {
    pub parts: Vec<(u32, Geometry)>,
}

impl Model {
    /// A model of one part.
    pub fn of(material: u32, geometry: Geometry) -> Self {
        Self { parts: vec![(material, geometry)] }
    }

    /// Adds geometry of a material.
    pub fn add(&mut self, material: u32, geometry: Geometry) {
        self.add_ref(material, &geometry);
    }

    fn add_ref(&mut self, material: u32, geometry: &Geometry) {
        match self.parts.iter_mut().find(|(known, _)| *known == material) {
            Some((_, part)) => part.append(geometry),
            None => self.parts.push((material, geometry.clone())),
        }
    }

    /// Adds a moved copy of another model.
    pub fn append(&mut self, other: &Self, map: Mat4) {
        for (material, geometry) in &other.parts {
            self.add(*material, geometry.clone().transformed(map));
        }
    }
}
