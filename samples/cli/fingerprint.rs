//! A hash of a scene, for the metadata of pictures.

use std::fmt::{self, Write};

use lucerna::{
    image::Layers,
    scene::{Environment, Mesh, Primitive, Scene, Texture},
};

/// A 64-bit hash over all data of the scene that can change a picture. It detects edited files, but is not cryptographic.
pub fn scene(scene: &Scene) -> String {
    // Destructured without `..`, so that a new field of `Scene` is a compile error until it is handled here.
    let Scene {
        name: _,
        nodes,
        meshes,
        materials,
        textures,
        lights,
        cameras,
        skins,
        animations,
        environment,
        added: _,
        notes: _,
    } = scene;
    let mut mixer = Mixer(0x9E37_79B9_7F4A_7C15);
    // Writing into a Mixer cannot fail.
    let _ = write!(mixer, "{nodes:?}{materials:?}{lights:?}{cameras:?}{skins:?}{animations:?}");
    for Mesh { name: _, primitives, weights } in meshes {
        mixer.word(primitives.len() as u64);
        mixer.floats(weights);
        for primitive in primitives {
            self::primitive(&mut mixer, primitive);
        }
    }
    for Texture { name: _, width, height, rgba } in textures {
        mixer.word(u64::from(*width) << 32 | u64::from(*height));
        for pair in rgba.chunks(2) {
            let half = |i: usize| pair.get(i).map_or(0, |&texel| u64::from(u32::from_le_bytes(texel)));
            mixer.word(half(0) << 32 | half(1));
        }
    }
    if let Some(Environment { name: _, width, height, pixels, rotation, scale }) = environment {
        mixer.word(u64::from(*width) << 32 | u64::from(*height));
        pixels.iter().for_each(|v| mixer.floats(&v.to_array()));
        mixer.floats(&[*rotation, *scale]);
    }
    format!("{:016x}", mixer.0)
}

fn primitive(mixer: &mut Mixer, primitive: &Primitive) {
    let Primitive { positions, normals, tangents, uvs, colors, joints, weights, morphs, indices, material } = primitive;
    // Each list is preceded by its length, so that moving an element from one list to the next changes the hash.
    for vectors in [positions, normals] {
        mixer.word(vectors.len() as u64);
        vectors.iter().for_each(|v| mixer.floats(&v.to_array()));
    }
    for vectors in [tangents, colors] {
        mixer.word(vectors.len() as u64);
        vectors.iter().for_each(|v| mixer.floats(&v.to_array()));
    }
    for set in uvs {
        mixer.word(set.len() as u64);
        set.iter().for_each(|v| mixer.floats(&v.to_array()));
    }
    mixer.word(indices.len() as u64);
    indices.iter().for_each(|&index| mixer.word(index.into()));
    mixer.word((*material).into());
    let _ = write!(mixer, "{joints:?}{weights:?}{morphs:?}");
}

/// The hash of a picture.
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
    use glam::{Mat4, Vec2, Vec3, Vec4};
    use lucerna::scene::{
        Animation, Camera, Channel, Interpolation, Keys, Light, LightKind, Material, MorphTarget, Node, Projection,
        Skin, TextureRef, Transform,
    };

    use super::*;

    /// A scene with an element of every kind.
    fn full() -> Scene {
        let morph = MorphTarget { positions: vec![Vec3::X; 3], normals: vec![Vec3::Y; 3], ..MorphTarget::default() };
        let primitive = Primitive {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            normals: vec![Vec3::Z; 3],
            tangents: vec![Vec4::new(1.0, 0.0, 0.0, 1.0); 3],
            uvs: vec![vec![Vec2::ZERO; 3], vec![Vec2::ONE; 3]],
            colors: vec![Vec4::ONE; 3],
            joints: vec![vec![[0; 4]; 3]],
            weights: vec![vec![Vec4::X; 3]],
            morphs: vec![morph],
            indices: vec![0, 1, 2],
            material: 0,
        };
        let channel = Channel {
            node: 0,
            interpolation: Interpolation::Linear,
            times: vec![0.0, 1.0],
            values: Keys::Translation(vec![Vec3::ZERO, Vec3::X]),
        };
        let projection = Projection::Perspective { yfov: 1.0, aspect: None, znear: 0.1, zfar: None };
        Scene {
            name: "full".into(),
            nodes: vec![Node { mesh: Some(0), ..Node::default() }, Node { light: Some(0), ..Node::default() }],
            meshes: vec![Mesh { primitives: vec![primitive], weights: vec![0.5], ..Mesh::default() }],
            materials: vec![Material { base_color_texture: Some(TextureRef::new(0)), ..Material::default() }],
            textures: vec![Texture {
                name: String::new(),
                width: 2,
                height: 1,
                rgba: vec![[1, 2, 3, 4], [5, 6, 7, 8]],
            }],
            lights: vec![Light {
                name: String::new(),
                kind: LightKind::Point { range: None },
                color: Vec3::ONE,
                intensity: 2.0,
            }],
            cameras: vec![Camera { name: String::new(), projection }],
            skins: vec![Skin { name: String::new(), joints: vec![0], inverse_bind: vec![Mat4::IDENTITY] }],
            animations: vec![Animation { name: String::new(), channels: vec![channel] }],
            environment: Some(Environment { width: 2, height: 1, ..Environment::constant(Vec3::ONE) }),
            notes: Vec::new(),
            added: None,
        }
    }

    /// A name and a change.
    type Edit = (&'static str, fn(&mut Scene));

    #[test]
    fn every_edit_shows() {
        let edits: [Edit; 37] = [
            ("a node's place", |s| s.nodes[1].local = Transform::Matrix(Mat4::from_translation(Vec3::X))),
            ("a node's mesh", |s| s.nodes[0].mesh = None),
            ("a node's skin", |s| s.nodes[0].skin = Some(0)),
            ("a node's parent", |s| s.nodes[1].parent = Some(0)),
            ("a node's weights", |s| s.nodes[0].weights = vec![0.5]),
            ("a mesh's weights", |s| s.meshes[0].weights[0] = 0.25),
            ("a mesh without primitives", |s| s.meshes.push(Mesh::default())),
            ("a position", |s| s.meshes[0].primitives[0].positions[1].y = 1e-7),
            ("a normal", |s| s.meshes[0].primitives[0].normals[2] = Vec3::X),
            ("a tangent's side", |s| s.meshes[0].primitives[0].tangents[0].w = -1.0),
            ("a texture coordinate", |s| s.meshes[0].primitives[0].uvs[1][2].x = 0.5),
            ("a set of texture coordinates", |s| drop(s.meshes[0].primitives[0].uvs.pop())),
            ("a colour", |s| s.meshes[0].primitives[0].colors[0].w = 0.5),
            ("a joint", |s| s.meshes[0].primitives[0].joints[0][1][2] = 1),
            ("a joint's weight", |s| s.meshes[0].primitives[0].weights[0][1] = Vec4::Y),
            ("a morph target", |s| s.meshes[0].primitives[0].morphs[0].positions[1].z = 0.1),
            ("the winding", |s| s.meshes[0].primitives[0].indices.swap(0, 1)),
            ("which material", |s| s.meshes[0].primitives[0].material = 1),
            ("a roughness", |s| s.materials[0].roughness = 0.5),
            ("an index of refraction", |s| s.materials[0].ior = 1.4),
            ("a texture's transform", |s| s.materials[0].base_color_texture.as_mut().unwrap().transform[4] = 0.5),
            ("a texel", |s| s.textures[0].rgba[1][2] = 4),
            ("a texture's shape", |s| (s.textures[0].width, s.textures[0].height) = (1, 2)),
            ("a light's kind", |s| s.lights[0].kind = LightKind::Directional),
            ("a light's range", |s| s.lights[0].kind = LightKind::Point { range: Some(1.0) }),
            ("a light's colour", |s| s.lights[0].color.x = 0.5),
            ("a light's intensity", |s| s.lights[0].intensity = 2.5),
            ("a camera", |s| {
                s.cameras[0].projection = Projection::Perspective { yfov: 0.9, aspect: None, znear: 0.1, zfar: None }
            }),
            ("a skin's joint", |s| s.skins[0].joints[0] = 1),
            ("a bind pose", |s| s.skins[0].inverse_bind[0] = Mat4::from_translation(Vec3::Y)),
            ("an animation's time", |s| s.animations[0].channels[0].times[1] = 2.0),
            ("an animation's key", |s| s.animations[0].channels[0].values = Keys::Translation(vec![Vec3::ZERO; 2])),
            ("an animation's way between keys", |s| s.animations[0].channels[0].interpolation = Interpolation::Step),
            ("a pixel of the sky", |s| s.environment.as_mut().unwrap().pixels[0].z = 0.9),
            ("the turn of the sky", |s| s.environment.as_mut().unwrap().rotation = 0.1),
            ("the brightness of the sky", |s| s.environment.as_mut().unwrap().scale = 1.1),
            ("no sky", |s| s.environment = None),
        ];
        let original = super::scene(&full());
        assert_eq!(original, super::scene(&full()));
        let mut seen = std::collections::HashSet::from([original]);
        for (what, edit) in edits {
            let mut edited = full();
            edit(&mut edited);
            assert!(seen.insert(super::scene(&edited)), "{what} does not show");
        }
        // The scene's name does not change a picture.
        assert!(seen.contains(&super::scene(&Scene { name: "other".into(), ..full() })));
    }

    #[test]
    fn every_edit_of_a_picture_shows() {
        let layer = || lucerna::image::Layer::new("", &["R", "G"], vec![1.0, 2.0, 3.0, 4.0]);
        let original = Layers::new(2, 1).with(layer());
        let named = |name: &str, channels: &[&str]| {
            Layers::new(2, 1).with(lucerna::image::Layer::new(name, channels, layer().data))
        };
        let mut bit = original.clone();
        bit.layers[0].data[3] = f32::from_bits(4.0f32.to_bits() + 1);
        let others = [named("x", &["R", "G"]), named("", &["G", "R"]), bit, original.clone().with(layer())];
        for other in &others {
            assert_ne!(super::image(other), super::image(&original));
        }
        assert_eq!(super::image(&original.clone()), super::image(&original));
    }
}
