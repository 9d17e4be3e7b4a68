//! A scene whose vertices have coordinates in a lightmap.

use std::collections::HashMap;

use glam::Vec2;

use super::super::{
    Stored,
    lightmap::{self, Corners},
};
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
/// Where backs have texels of their own, they become further primitives that face the other way, and their materials become one-sided. So backs of
/// the same materials without light vanish. Materials that let light through stay as they are, because one-sided glass is solid.
///
/// # Errors
/// `Input` if the bake is no lightmap of this scene, or if textures use all sets of coordinates.
pub fn unwrapped(scene: &Scene, stored: &Stored) -> Result<Unwrapping> {
    let Corners { fronts, backs } = &stored.corners;
    let counts = lightmap::triangles(scene);
    let all: u64 = counts.iter().map(|count| u64::from(*count)).sum();
    if fronts.is_empty() || all != fronts.len() as u64 {
        return Err(Error::input(format!("has places for {} triangles, the scene has {all}", fronts.len())));
    }
    let Some(uv_set) = free_set(&scene.materials) else {
        return Err(Error::input(format!("textures use all {MAX_UV_SETS} sets of texture coordinates"))
            .help("Make one of the sets 1 to 3 free for the lightmap"));
    };
    let [width, height] = stored.plan.extent;
    let scale = Vec2::new(1.0 / width as f32, 1.0 / height as f32);
    let mut out = scene.clone();
    let backs = backs.as_deref().unwrap_or_default();
    out.meshes.clear();
    let mut vertices = [0, 0];
    let mut first = 0;
    for node in 0..scene.nodes.len() {
        let Some(mesh) = scene.nodes[node].mesh.and_then(|mesh| scene.meshes.get(mesh as usize)) else { continue };
        let known = |primitive: &&Primitive| (primitive.material as usize) < scene.materials.len();
        let mut primitives = Vec::new();
        for primitive in mesh.primitives.iter().filter(known) {
            let count = primitive.indices.len() / 3;
            let of_fronts = (0..).zip(fronts.get(first..first + count).unwrap_or_default().iter().copied());
            let split_fronts = split(primitive, of_fronts, uv_set as usize, scale);
            let [from, until] =
                [first, first + count].map(|end| backs.partition_point(|(triangle, _)| (*triangle as usize) < end));
            let of_backs = backs[from..until].iter().map(|(triangle, place)| (*triangle as usize - first, *place));
            let is_glass = scene.materials[primitive.material as usize].transmission > 0.0;
            let split_backs = (from < until && !is_glass).then(|| {
                out.materials[primitive.material as usize].double_sided = false;
                turned(split(primitive, of_backs, uv_set as usize, scale))
            });
            first += count;
            vertices[0] += primitive.positions.len();
            for split in [Some(split_fronts), split_backs].into_iter().flatten() {
                vertices[1] += split.positions.len();
                primitives.push(split);
            }
        }
        out.nodes[node].mesh = Some(out.meshes.len() as u32);
        out.meshes.push(Mesh { name: mesh.name.clone(), primitives, weights: mesh.weights.clone() });
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

/// Some triangles of a primitive, with a vertex for each pair of a vertex and a place in the lightmap. `places`: of the triangles with these numbers.
fn split(
    primitive: &Primitive,
    places: impl Iterator<Item = (usize, [u16; 6])>,
    uv_set: usize,
    scale: Vec2,
) -> Primitive {
    let mut known: HashMap<(u32, [u16; 2]), u32> = HashMap::new();
    let (mut from, mut uvs, mut indices) = (Vec::new(), Vec::new(), Vec::new());
    for (triangle, place) in places {
        let at = lightmap::position(place);
        for (corner, vertex) in primitive.indices[3 * triangle..3 * triangle + 3].iter().enumerate() {
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

/// The primitive that faces the other way.
fn turned(mut primitive: Primitive) -> Primitive {
    primitive.indices.chunks_exact_mut(3).for_each(|triangle| triangle.swap(1, 2));
    let morphs = primitive.morphs.iter_mut();
    let morphed = morphs.flat_map(|morph| morph.normals.iter_mut().chain(&mut morph.tangents));
    primitive.normals.iter_mut().chain(morphed).for_each(|vector| *vector = -*vector);
    // With the normal, a tangent and its sign turn, so that the bitangent turns as well: the back shows the detail of the front from behind.
    primitive.tangents.iter_mut().for_each(|tangent| *tangent = -*tangent);
    primitive
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
    use glam::{Vec3, Vec4, vec2, vec4};

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
            let split = split(&primitive, (0..).zip(places), 2, vec2(0.1, 0.2));
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
    #[test]
    fn a_back_faces_the_other_way_with_the_detail_of_its_front() {
        let primitive = Primitive {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::ONE, Vec3::Y],
            normals: vec![Vec3::Z; 4],
            tangents: vec![vec4(1.0, 0.0, 0.0, -1.0); 4],
            indices: vec![0, 1, 2, 0, 2, 3],
            ..Primitive::default()
        };
        let back = turned(split(&primitive, [(1, [80, 16, 96, 32, 80, 32])].into_iter(), 1, Vec2::ONE));
        let [a, b, c] = [0, 1, 2].map(|corner| back.positions[back.indices[corner] as usize]);
        assert_eq!([a, b, c], [Vec3::ZERO, Vec3::Y, Vec3::ONE], "the second triangle, turned");
        assert_eq!(back.uvs[1], [vec2(5.0, 1.0), vec2(6.0, 2.0), vec2(5.0, 2.0)]);
        let bitangent = |normal: Vec3, tangent: Vec4| tangent.w * normal.cross(tangent.truncate());
        for (normal, tangent) in back.normals.iter().zip(&back.tangents) {
            assert_eq!((*normal, tangent.truncate()), (-Vec3::Z, -Vec3::X));
            assert_eq!(bitangent(*normal, *tangent), -bitangent(Vec3::Z, primitive.tangents[0]));
        }
    }
}
