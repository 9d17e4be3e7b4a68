//! Which glass of a file is a solid body and which is a thin sheet: OBJ does not say, its meshes do.
//!
//! A body bends light and is single-sided, as in glTF; a sheet has both its interfaces in one surface, bends nothing and is
//! double-sided. A part is a body where its triangles, joined over edges at equal positions, close around a volume: every edge is
//! run through in both directions equally often. Bodies that are wound inside out are turned, but for cavities in others.

use super::super::{Material, Mesh, Primitive, folder::shorten, notes::Notes};
use glam::{DVec3, Vec3};
use std::collections::HashMap;

/// A triangle: mesh, primitive, and number in it.
type Place = (usize, usize, usize);

/// A part of the glass of one material.
struct Part {
    places: Vec<Place>,
    low: Vec3,
    high: Vec3,
    /// m³, negative if wound inside out; zero for a sheet.
    volume: f64,
}

/// Makes closed bodies of transmitting materials single-sided, with their fronts outwards. A material of both bodies and sheets
/// becomes two.
pub fn tell_apart(meshes: &mut [Mesh], materials: &mut Vec<Material>, notes: &mut Notes) {
    for material in 0..materials.len() {
        if materials[material].transmission <= 0.0 {
            continue;
        }
        let parts = parts(meshes, material as u32);
        let solid: Vec<usize> = (0..parts.len()).filter(|&i| parts[i].volume != 0.0).collect();
        if solid.len() < parts.len() {
            let text = format!(
                "{} of {} parts of this glass are open: taken for thin panes, which do not bend light",
                parts.len() - solid.len(),
                parts.len()
            );
            notes.approximated(format!("material {:?}", shorten(&materials[material].name)), text);
        }
        if solid.is_empty() {
            continue;
        }
        turn_out(meshes, &parts, &solid);
        if solid.len() == parts.len() {
            materials[material].double_sided = false;
            continue;
        }
        let body = materials.len() as u32;
        materials.push(Material { double_sided: false, ..materials[material].clone() });
        let places = solid.iter().flat_map(|&i| &parts[i].places);
        let mut inside: HashMap<(usize, usize), Vec<bool>> = HashMap::new();
        for &(mesh, primitive, triangle) in places {
            let count = meshes[mesh].primitives[primitive].indices.len() / 3;
            inside.entry((mesh, primitive)).or_insert_with(|| vec![false; count])[triangle] = true;
        }
        // In order, so that the same file gives the same scene.
        let mut inside: Vec<_> = inside.into_iter().collect();
        inside.sort_unstable_by_key(|(place, _)| *place);
        for ((mesh, primitive), chosen) in inside {
            let whole = &mut meshes[mesh].primitives[primitive];
            if chosen.iter().all(|&chosen| chosen) {
                whole.material = body;
                continue;
            }
            let mut solid = keep(whole, |triangle| chosen[triangle]);
            solid.material = body;
            *whole = keep(whole, |triangle| !chosen[triangle]);
            meshes[mesh].primitives.push(solid);
        }
    }
}

/// The primitive with some of its triangles and the vertices that they need.
fn keep(whole: &Primitive, chosen: impl Fn(usize) -> bool) -> Primitive {
    let mut new = vec![u32::MAX; whole.positions.len()];
    let (mut from, mut indices) = (Vec::new(), Vec::new());
    for (triangle, corners) in whole.indices.chunks_exact(3).enumerate() {
        if !chosen(triangle) {
            continue;
        }
        for &corner in corners {
            let at = &mut new[corner as usize];
            if *at == u32::MAX {
                *at = from.len() as u32;
                from.push(corner);
            }
            indices.push(*at);
        }
    }
    let mut out = whole.clone();
    out.gather_vertices(&from);
    out.indices = indices;
    out
}

/// The parts of a material that hang together over edges.
fn parts(meshes: &[Mesh], material: u32) -> Vec<Part> {
    // Corners by position: files repeat positions for normals and texture coordinates.
    let mut points: HashMap<[u32; 3], u32> = HashMap::new();
    let mut places: Vec<Place> = Vec::new();
    let mut triangles: Vec<([u32; 3], [Vec3; 3])> = Vec::new();
    for (m, mesh) in meshes.iter().enumerate() {
        for (p, primitive) in mesh.primitives.iter().enumerate().filter(|(_, p)| p.material == material) {
            for (t, corners) in primitive.indices.chunks_exact(3).enumerate() {
                let at = [0, 1, 2].map(|i| primitive.positions[corners[i] as usize]);
                let ids = at.map(|position| {
                    // Zero has two signs.
                    let next = points.len() as u32;
                    *points.entry((position + Vec3::ZERO).to_array().map(f32::to_bits)).or_insert(next)
                });
                places.push((m, p, t));
                triangles.push((ids, at));
            }
        }
    }
    let edges = |ids: [u32; 3]| [(ids[0], ids[1]), (ids[1], ids[2]), (ids[2], ids[0])];
    let mut root: Vec<u32> = (0..triangles.len() as u32).collect();
    // First triangle of an edge, and how much oftener it is run through upwards than downwards.
    let mut shared: HashMap<(u32, u32), (u32, i32)> = HashMap::with_capacity(2 * triangles.len());
    for (i, (ids, _)) in triangles.iter().enumerate() {
        for (a, b) in edges(*ids) {
            let entry = shared.entry((a.min(b), a.max(b))).or_insert((i as u32, 0));
            entry.1 += if a < b { 1 } else { -1 };
            let (one, other) = (find(&mut root, entry.0), find(&mut root, i as u32));
            root[other.max(one) as usize] = other.min(one);
        }
    }
    let mut numbers: HashMap<u32, usize> = HashMap::new();
    let mut parts: Vec<Part> = Vec::new();
    let mut open: Vec<bool> = Vec::new();
    for (i, (ids, at)) in triangles.iter().enumerate() {
        let number = *numbers.entry(find(&mut root, i as u32)).or_insert_with(|| {
            parts.push(Part { places: Vec::new(), low: at[0], high: at[0], volume: 0.0 });
            open.push(false);
            parts.len() - 1
        });
        let part = &mut parts[number];
        part.places.push(places[i]);
        (part.low, part.high) = at.iter().fold((part.low, part.high), |(low, high), p| (low.min(*p), high.max(*p)));
        open[number] |= edges(*ids).iter().any(|(a, b)| shared.get(&(*a.min(b), *a.max(b))).is_some_and(|e| e.1 != 0));
    }
    for (part, open) in parts.iter_mut().zip(open) {
        part.volume = if open { 0.0 } else { volume(meshes, part) };
    }
    parts
}

fn find(root: &mut [u32], mut i: u32) -> u32 {
    while root[i as usize] != i {
        root[i as usize] = root[root[i as usize] as usize];
        i = root[i as usize];
    }
    i
}

/// Signed volume of a closed part, m³; zero where it is nothing beside its box, as of a sheet with two equal sides.
fn volume(meshes: &[Mesh], part: &Part) -> f64 {
    // From a place nearby, or large coordinates would eat the digits.
    let origin = part.low.as_dvec3();
    let six: f64 = part
        .places
        .iter()
        .map(|&(mesh, primitive, triangle)| {
            let primitive = &meshes[mesh].primitives[primitive];
            let corner =
                |i: usize| primitive.positions[primitive.indices[3 * triangle + i] as usize].as_dvec3() - origin;
            corner(0).dot(corner(1).cross(corner(2)))
        })
        .sum();
    let size: DVec3 = part.high.as_dvec3() - origin;
    if six.abs() > 1e-6 * size.length().powi(3) { six / 6.0 } else { 0.0 }
}

/// Turns bodies that are wound inside out, but for those in others, which are cavities.
fn turn_out(meshes: &mut [Mesh], parts: &[Part], solid: &[usize]) {
    for &i in solid.iter().filter(|&&i| parts[i].volume < 0.0) {
        let part = &parts[i];
        let around =
            |other: &Part| other.volume > 0.0 && other.low.cmple(part.low).all() && other.high.cmpge(part.high).all();
        if solid.iter().any(|&j| j != i && around(&parts[j])) {
            continue;
        }
        let mut turned: HashMap<(usize, usize), Vec<bool>> = HashMap::new();
        for &(mesh, number, triangle) in &part.places {
            let primitive = &mut meshes[mesh].primitives[number];
            primitive.indices.swap(3 * triangle + 1, 3 * triangle + 2);
            let count = primitive.positions.len();
            let done = turned.entry((mesh, number)).or_insert_with(|| vec![false; count]);
            for k in 0..3 {
                let corner = primitive.indices[3 * triangle + k] as usize;
                if !std::mem::replace(&mut done[corner], true) {
                    primitive.normals[corner] = -primitive.normals[corner];
                    primitive.tangents[corner].w = -primitive.tangents[corner].w;
                }
            }
        }
    }
}
