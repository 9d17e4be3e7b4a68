//! A number that changes when a scene changes, for the metadata of pictures.

use std::fmt::{self, Write};

use lucerna::{image::Layers, scene::Scene};

/// 64 bits over everything of the scene that can reach a picture. For finding out that a file was edited, not for security.
pub fn scene(scene: &Scene) -> String {
    let mut mixer = Mixer(0x9E37_79B9_7F4A_7C15);
    // Writing into a Mixer cannot fail.
    let _ = write!(mixer, "{:?}{:?}{:?}{:?}", scene.nodes, scene.materials, scene.lights, scene.cameras);
    let _ = write!(mixer, "{:?}{:?}", scene.skins, scene.animations);
    for primitive in scene.meshes.iter().flat_map(|mesh| &mesh.primitives) {
        mixer.word(primitive.positions.len() as u64);
        primitive.positions.iter().chain(&primitive.normals).for_each(|v| mixer.floats(&v.to_array()));
        primitive.tangents.iter().chain(&primitive.colors).for_each(|v| mixer.floats(&v.to_array()));
        primitive.uvs.iter().flatten().for_each(|v| mixer.floats(&v.to_array()));
        primitive.indices.iter().for_each(|&index| mixer.word(index.into()));
        mixer.word(primitive.material.into());
        let _ = write!(mixer, "{:?}{:?}{:?}", primitive.joints, primitive.weights, primitive.morphs);
    }
    for texture in &scene.textures {
        mixer.word(u64::from(texture.width) << 32 | u64::from(texture.height));
        for pair in texture.rgba.chunks(2) {
            let half = |i: usize| pair.get(i).map_or(0, |&texel| u64::from(u32::from_le_bytes(texel)));
            mixer.word(half(0) << 32 | half(1));
        }
    }
    if let Some(environment) = &scene.environment {
        environment.pixels.iter().for_each(|v| mixer.floats(&v.to_array()));
        mixer.floats(&[environment.rotation, environment.scale, environment.width as f32]);
    }
    format!("{:016x}", mixer.0)
}

/// The same of a picture.
pub fn image(image: &Layers) -> String {
    let mut mixer = Mixer(0x9E37_79B9_7F4A_7C15);
    mixer.word(u64::from(image.width) << 32 | u64::from(image.height));
    for layer in &image.layers {
        let _ = write!(mixer, "{:?}{:?}", layer.name, layer.channels);
        mixer.floats(&layer.data);
    }
    format!("{:016x}", mixer.0)
}

struct Mixer(u64);

impl Mixer {
    fn word(&mut self, word: u64) {
        self.0 = (self.0 ^ word).wrapping_mul(0xD6E8_FEB8_6659_FD93);
        self.0 ^= self.0 >> 32;
    }

    fn floats(&mut self, values: &[f32]) {
        for value in values {
            self.word(value.to_bits().into());
        }
    }
}

impl fmt::Write for Mixer {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for chunk in text.as_bytes().chunks(8) {
            let mut word = [0; 8];
            word[..chunk.len()].copy_from_slice(chunk);
            self.word(u64::from_le_bytes(word) ^ (chunk.len() as u64) << 60);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use lucerna::scene::{Material, Mesh, Primitive, Texture};

    use super::*;

    #[test]
    fn every_edit_shows() {
        let primitive =
            Primitive { positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y], indices: vec![0, 1, 2], ..Primitive::default() };
        let texture = Texture { name: String::new(), width: 1, height: 1, rgba: vec![[1, 2, 3, 4]] };
        let original = Scene {
            meshes: vec![Mesh { primitives: vec![primitive], ..Mesh::default() }],
            textures: vec![texture],
            materials: vec![Material::default()],
            ..Scene::default()
        };
        let edits: [fn(&mut Scene); 4] = [
            |s| s.meshes[0].primitives[0].positions[1].y = 1e-7,
            |s| s.meshes[0].primitives[0].indices.swap(0, 1),
            |s| s.textures[0].rgba[0][2] = 4,
            |s| s.materials[0].roughness = 0.5,
        ];
        assert_eq!(super::scene(&original), super::scene(&original.clone()));
        for (index, edit) in edits.iter().enumerate() {
            let mut edited = original.clone();
            edit(&mut edited);
            assert_ne!(super::scene(&edited), super::scene(&original), "edit {index}");
        }
    }
}
