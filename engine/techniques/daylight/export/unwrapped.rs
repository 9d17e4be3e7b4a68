//! A scene whose vertices have coordinates in a lightmap.

use std::collections::HashMap;

use glam::Vec2;

use super::super::{Stored, lightmap};
use crate::{
    Error, Result,
    scene::{MAX_UV_SETS, Material, Mesh, MorphTarget, Primitive, Scene},
};

/// A scene with coordinates in a lightmap.
#[derive(Clone, Debug)]
pub struct Unwrapping {
    pub scene: Scene,
    /// The set of texture coordinates that belongs to the lightmap; (0, 0) is the corner of its first texel.
    pub uv_set: u32,
    /// Vertices before and after they were split where charts end.
    pub vertices: [usize; 2],
}

/// Gives each mesh of a node coordinates in the lightmap. Each node gets a mesh of its own, because instances have different places, and
/// vertices are split where charts end. No texture of the scene uses the set of coordinates.
///
/// # Errors
/// `Input` if the bake is no lightmap of this scene, or if textures use all sets of coordinates.
pub fn unwrapped(scene: &Scene, stored: &Stored) -> Result<Unwrapping> {
    let corners = &stored.corners;
    let counts = lightmap::triangles(scene);
    let all: u64 = counts.iter().map(|count| u64::from(*count)).sum();
    if corners.is_empty() || all != corners.len() as u64 {
        return Err(Error::input(format!("has places for {} triangles, the scene has {all}", corners.len())));
    }
    let Some(uv_set) = free_set(&scene.materials) else {
        return Err(Error::input(format!("textures use all {MAX_UV_SETS} sets of texture coordinates"))
            .help("Make one of the sets 1 to 3 free for the lightmap"));
    };
    let [width, height] = stored.plan.extent;
    let scale = Vec2::new(1.0 / width as f32, 1.0 / height as f32);
    let mut out = scene.clone();
    out.meshes.clear();
    let mut vertices = [0, 0];
    let mut first = 0;
    for node in 0..scene.nodes.len() {
        let Some(mesh) = scene.nodes[node].mesh.and_then(|mesh| scene.meshes.get(mesh as usize)) else { continue };
        let known = |primitive: &&Primitive| (primitive.material as usize) < scene.materials.len();
        let primitives = mesh.primitives.iter().filter(known).map(|primitive| {
            let count = primitive.indices.len() / 3;
            let places = corners.get(first..first + count).unwrap_or_default();
            first += count;
            let split = split(primitive, places, uv_set as usize, scale);
            vertices[0] += primitive.positions.len();
            vertices[1] += split.positions.len();
            split
        });
        let mesh = Mesh { name: mesh.name.clone(), primitives: primitives.collect(), weights: mesh.weights.clone() };
        out.nodes[node].mesh = Some(out.meshes.len() as u32);
        out.meshes.push(mesh);
    }
    Ok(Unwrapping { scene: out, uv_set, vertices })
}

/// The first set of coordinates after set 0 that no texture uses.
fn free_set(materials: &[Material]) -> Option<u32> {
    let used: Vec<u32> = materials.iter().flat_map(uv_sets).collect();
    (1..MAX_UV_SETS as u32).find(|set| !used.contains(set))
}

/// The sets of coordinates that the textures of a material use.
fn uv_sets(material: &Material) -> impl Iterator<Item = u32> {
    [
        material.base_color_texture,
        material.metallic_roughness_texture,
        material.normal_texture,
        material.occlusion_texture,
        material.emissive_texture,
        material.transmission_texture,
    ]
    .into_iter()
    .flatten()
    .map(|texture| texture.uv_set)
}

/// The primitive with a vertex for each pair of a vertex and a place in the lightmap.
fn split(primitive: &Primitive, places: &[[u16; 6]], uv_set: usize, scale: Vec2) -> Primitive {
    let mut known: HashMap<(u32, [u16; 2]), u32> = HashMap::new();
    let (mut from, mut uvs, mut indices) = (Vec::new(), Vec::new(), Vec::new());
    for (triangle, place) in primitive.indices.chunks_exact(3).zip(places) {
        let at = lightmap::position(*place);
        for (corner, vertex) in triangle.iter().enumerate() {
            let key = (*vertex, [place[2 * corner], place[2 * corner + 1]]);
            indices.push(*known.entry(key).or_insert_with(|| {
                from.push(*vertex as usize);
                uvs.push(at[corner] * scale);
                from.len() as u32 - 1
            }));
        }
    }
    let count = from.len();
    let mut sets: Vec<Vec<Vec2>> = primitive.uvs.iter().map(|set| taken(set, &from)).collect();
    // Sets have to follow one another without a gap.
    sets.resize(sets.len().max(uv_set + 1), Vec::new());
    for set in &mut sets[..uv_set] {
        set.resize(count, Vec2::ZERO);
    }
    sets[uv_set] = uvs;
    Primitive {
        positions: taken(&primitive.positions, &from),
        normals: taken(&primitive.normals, &from),
        tangents: taken(&primitive.tangents, &from),
        uvs: sets,
        colors: taken(&primitive.colors, &from),
        joints: primitive.joints.iter().map(|set| taken(set, &from)).collect(),
        weights: primitive.weights.iter().map(|set| taken(set, &from)).collect(),
        morphs: primitive.morphs.iter().map(|morph| morphed(morph, &from)).collect(),
        indices,
        material: primitive.material,
    }
}

fn morphed(morph: &MorphTarget, from: &[usize]) -> MorphTarget {
    MorphTarget {
        positions: taken(&morph.positions, from),
        normals: taken(&morph.normals, from),
        tangents: taken(&morph.tangents, from),
        colors: taken(&morph.colors, from),
        uvs: morph.uvs.iter().map(|set| taken(set, from)).collect(),
    }
}

/// The values of some vertices; none if there are none.
fn taken<T: Copy>(values: &[T], from: &[usize]) -> Vec<T> {
    if values.is_empty() { Vec::new() } else { from.iter().map(|vertex| values[*vertex]).collect() }
}

#[cfg(test)]
mod tests {
    use glam::{Vec3, vec2};

    use super::*;
    use crate::scene::TextureRef;

    #[test]
    fn the_lightmap_gets_the_first_free_set() {
        let on = |set: u32| Material {
            emissive_texture: Some(TextureRef { uv_set: set, ..TextureRef::new(0) }),
            ..Material::default()
        };
        assert_eq!(free_set(&[]), Some(1));
        assert_eq!(free_set(&[on(0), on(1)]), Some(2));
        assert_eq!(free_set(&[on(1), on(2), on(3)]), None);
    }

    #[test]
    fn vertices_are_split_only_where_charts_end() {
        let primitive = Primitive {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::ONE, Vec3::Y],
            normals: vec![Vec3::Z; 4],
            indices: vec![0, 1, 2, 0, 2, 3],
            ..Primitive::default()
        };
        let one = [[16, 16, 32, 16, 32, 32], [16, 16, 32, 32, 16, 32]];
        let two = [[16, 16, 32, 16, 32, 32], [80, 16, 96, 32, 80, 32]];
        for (places, vertices) in [(one, 4), (two, 6)] {
            let split = split(&primitive, &places, 2, vec2(0.1, 0.2));
            assert_eq!((split.positions.len(), split.normals.len(), split.uvs.len()), (vertices, vertices, 3));
            assert!(split.uvs[..2].iter().all(|set| *set == vec![Vec2::ZERO; vertices]));
            assert!(split.tangents.is_empty() && split.colors.is_empty());
            for (corner, (old, new)) in primitive.indices.iter().zip(&split.indices).enumerate() {
                let at = |i: usize| f32::from(places[corner / 3][2 * (corner % 3) + i]) / 16.0;
                assert_eq!(primitive.positions[*old as usize], split.positions[*new as usize]);
                assert!(split.uvs[2][*new as usize].distance(vec2(0.1 * at(0), 0.2 * at(1))) < 1e-6);
            }
        }
    }
}
