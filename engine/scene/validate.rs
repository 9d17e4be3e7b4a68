//! Checks of a whole scene, whatever made it.

use super::{Keys, Material, Mesh, Primitive, Scene, TextureRef, Transform};
use crate::{Error, Result};
use glam::{Vec2, Vec3, Vec4};

impl Material {
    /// The textures that are used, in a fixed order.
    pub fn textures(&self) -> impl Iterator<Item = &TextureRef> {
        [
            &self.base_color_texture,
            &self.metallic_roughness_texture,
            &self.normal_texture,
            &self.occlusion_texture,
            &self.emissive_texture,
            &self.transmission_texture,
        ]
        .into_iter()
        .flatten()
    }
}

impl Scene {
    /// Checks that every index is in range, every list as long as the others of its kind, every number finite, and the scene at rest
    /// neither too large nor too small ([`super::extent`]; moving ones are checked pose by pose).
    ///
    /// Front ends give only scenes that pass; scenes built by a program may be checked with it.
    ///
    /// # Errors
    /// [`ErrorKind::Input`](crate::ErrorKind::Input), naming the first element that does not hold.
    pub fn validate(&self) -> Result<()> {
        let joints_used: Vec<Option<u16>> = self.meshes.iter().map(highest_joint).collect();
        for (i, node) in self.nodes.iter().enumerate() {
            let check = || {
                if let Some(parent) = node.parent.filter(|&parent| parent as usize >= i) {
                    return Err(Error::input(format!("{parent} does not stand before its child")).at("parent"));
                }
                in_range(node.mesh, self.meshes.len(), "mesh")?;
                in_range(node.skin, self.skins.len(), "skin")?;
                in_range(node.light, self.lights.len(), "light")?;
                in_range(node.camera, self.cameras.len(), "camera")?;
                if let Some(mesh) = node.mesh.filter(|_| !node.weights.is_empty()) {
                    same(node.weights.len(), self.meshes[mesh as usize].weights.len(), "weights")?;
                }
                finite(&node.weights, "weights")?;
                match node.local {
                    Transform::Matrix(matrix) => finite(&matrix.to_cols_array(), "local"),
                    Transform::Trs { translation, rotation, scale } => {
                        finite(&translation.to_array(), "translation")?;
                        finite(&rotation.to_array(), "rotation")?;
                        finite(&scale.to_array(), "scale")
                    }
                }
            };
            check().map_err(|error: Error| error.at(format!("nodes[{i}]")))?;
            if let (Some(mesh), Some(skin)) = (node.mesh, node.skin) {
                let joints = self.skins[skin as usize].joints.len();
                if let Some(joint) = joints_used[mesh as usize].filter(|&joint| usize::from(joint) >= joints) {
                    return Err(Error::input(format!(
                        "meshes[{mesh}] uses joint {joint}, the skin has {joints} joints"
                    ))
                    .at(format!("nodes[{i}].skin")));
                }
            }
        }
        for (i, mesh) in self.meshes.iter().enumerate() {
            self.check_mesh(mesh).map_err(|error| error.at(format!("meshes[{i}]")))?;
        }
        for (i, material) in self.materials.iter().enumerate() {
            for texture in material.textures() {
                in_range(Some(texture.texture), self.textures.len(), "texture")
                    .and_then(|()| finite(&texture.transform, "transform"))
                    .map_err(|error| error.at(format!("materials[{i}]")))?;
            }
        }
        for (i, texture) in self.textures.iter().enumerate() {
            let texels = texture.width as usize * texture.height as usize;
            let nothing = texels == 0;
            same(texture.rgba.len(), if nothing { usize::MAX } else { texels }, "rgba")
                .map_err(|error| error.at(format!("textures[{i}]")))?;
        }
        for (i, skin) in self.skins.iter().enumerate() {
            let check = || {
                same(skin.inverse_bind.len(), skin.joints.len(), "inverse_bind")?;
                skin.inverse_bind.iter().try_for_each(|matrix| finite(&matrix.to_cols_array(), "inverse_bind"))?;
                skin.joints.iter().try_for_each(|&joint| in_range(Some(joint), self.nodes.len(), "joints"))
            };
            check().map_err(|error: Error| error.at(format!("skins[{i}]")))?;
        }
        self.check_animations()?;
        // Last, for it follows the indices.
        super::extent::Extents::of(self).check(self, &super::Pose::rest(self))
    }

    fn check_mesh(&self, mesh: &Mesh) -> Result<()> {
        finite(&mesh.weights, "weights")?;
        for (i, primitive) in mesh.primitives.iter().enumerate() {
            let check = || {
                in_range(Some(primitive.material), self.materials.len(), "material")?;
                same(primitive.morphs.len(), mesh.weights.len(), "morphs")?;
                check_primitive(primitive)
            };
            check().map_err(|error: Error| error.at(format!("primitives[{i}]")))?;
        }
        Ok(())
    }

    fn check_animations(&self) -> Result<()> {
        for (i, animation) in self.animations.iter().enumerate() {
            for (c, channel) in animation.channels.iter().enumerate() {
                let check = || {
                    in_range(Some(channel.node), self.nodes.len(), "node")?;
                    finite(&channel.times, "times")?;
                    if channel.times.is_empty() || channel.times.windows(2).any(|pair| pair[0] >= pair[1]) {
                        return Err(Error::input("are empty or do not increase").at("times"));
                    }
                    let cubic = channel.interpolation == super::Interpolation::CubicSpline;
                    let keys = channel.times.len() * if cubic { 3 } else { 1 };
                    match &channel.values {
                        Keys::Translation(values) | Keys::Scale(values) => {
                            same(values.len(), keys, "values")?;
                            values.iter().try_for_each(|value| finite(&value.to_array(), "values"))
                        }
                        Keys::Rotation(values) => {
                            same(values.len(), keys, "values")?;
                            values.iter().try_for_each(|value| finite(&value.to_array(), "values"))
                        }
                        Keys::Weights { count, values } => {
                            let mesh = self.nodes[channel.node as usize].mesh;
                            let targets = mesh.map_or(0, |mesh| self.meshes[mesh as usize].weights.len());
                            same(*count, targets, "count")?;
                            same(values.len(), keys * count, "values")?;
                            finite(values, "values")
                        }
                    }
                };
                check().map_err(|error: Error| error.at(format!("animations[{i}].channels[{c}]")))?;
            }
        }
        Ok(())
    }
}

/// The highest joint that a mesh refers to.
fn highest_joint(mesh: &Mesh) -> Option<u16> {
    mesh.primitives.iter().flat_map(|primitive| &primitive.joints).flatten().flatten().copied().max()
}

fn check_primitive(primitive: &Primitive) -> Result<()> {
    let count = primitive.positions.len();
    same(primitive.normals.len(), count, "normals")?;
    same(primitive.tangents.len(), count, "tangents")?;
    if primitive.uvs.len() > super::MAX_UV_SETS {
        return Err(Error::input(format!("{} sets, {} are allowed", primitive.uvs.len(), super::MAX_UV_SETS)).at("uvs"));
    }
    for set in &primitive.uvs {
        optional(set.len(), count, "uvs")?;
        all_finite(set, Vec2::is_finite, "uvs")?;
    }
    optional(primitive.colors.len(), count, "colors")?;
    same(primitive.weights.len(), primitive.joints.len(), "weights")?;
    for (joints, weights) in primitive.joints.iter().zip(&primitive.weights) {
        same(joints.len(), count, "joints")?;
        same(weights.len(), count, "weights")?;
        all_finite(weights, Vec4::is_finite, "weights")?;
    }
    for (i, morph) in primitive.morphs.iter().enumerate() {
        let check = || {
            optional(morph.positions.len(), count, "positions")?;
            optional(morph.normals.len(), count, "normals")?;
            optional(morph.tangents.len(), count, "tangents")?;
            optional(morph.colors.len(), count, "colors")?;
            morph.uvs.iter().try_for_each(|set| optional(set.len(), count, "uvs"))?;
            all_finite(&morph.positions, Vec3::is_finite, "positions")?;
            all_finite(&morph.normals, Vec3::is_finite, "normals")?;
            all_finite(&morph.tangents, Vec3::is_finite, "tangents")
        };
        check().map_err(|error: Error| error.at(format!("morphs[{i}]")))?;
    }
    all_finite(&primitive.positions, Vec3::is_finite, "positions")?;
    all_finite(&primitive.normals, Vec3::is_finite, "normals")?;
    all_finite(&primitive.tangents, Vec4::is_finite, "tangents")?;
    all_finite(&primitive.colors, Vec4::is_finite, "colors")?;
    if !primitive.indices.len().is_multiple_of(3) {
        return Err(Error::input(format!("{} do not make whole triangles", primitive.indices.len())).at("indices"));
    }
    match primitive.indices.iter().position(|&index| index as usize >= count) {
        None => Ok(()),
        Some(at) => {
            let index = primitive.indices[at];
            Err(Error::input(format!("index {index} (at {at}) but there are {count} vertices")).at("indices"))
        }
    }
}

fn in_range(index: Option<u32>, length: usize, what: &str) -> Result<()> {
    match index.filter(|&index| index as usize >= length) {
        None => Ok(()),
        Some(index) => Err(Error::input(format!("index {index}, there are {length}")).at(what)),
    }
}

fn same(length: usize, wanted: usize, what: &str) -> Result<()> {
    match length == wanted {
        true => Ok(()),
        false => Err(Error::input(format!("{length} elements, {wanted} are needed")).at(what)),
    }
}

fn optional(length: usize, wanted: usize, what: &str) -> Result<()> {
    if length == 0 { Ok(()) } else { same(length, wanted, what) }
}

fn finite(values: &[f32], what: &str) -> Result<()> {
    match values.iter().find(|value| !value.is_finite()) {
        None => Ok(()),
        Some(value) => Err(Error::input(format!("{value} is not finite")).at(what)),
    }
}

fn all_finite<T: Copy>(values: &[T], finite: impl Fn(T) -> bool, what: &str) -> Result<()> {
    match values.iter().position(|&value| !finite(value)) {
        None => Ok(()),
        Some(at) => Err(Error::input(format!("element {at} is not finite")).at(what)),
    }
}
