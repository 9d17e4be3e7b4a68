//! Wavefront OBJ with MTL materials.
//!
//! Its own reader: the crates at hand panic on malformed files, read polylines as faces, lose the names of materials
//! whose file is missing, and cannot say in which line an error is. Read are vertices (with weights and colours),
//! texture coordinates, normals, polygons (also concave), groups, objects and materials. Free-form surfaces, points
//! and lines are counted in the notes. Smoothing groups are not read: where a file has no normals, edges up to 45° are
//! smooth.

mod delaunay;
mod materials;
mod mtl;
mod parse;
mod polygon;
mod solid;

use super::{
    Limits, Material, Mesh, Node, Primitive, Scene, Transform,
    budget::Budget,
    folder::{Folder, shorten},
    normals,
    notes::Notes,
    surface,
};
use crate::{Error, Result};
use glam::{Quat, Vec3, Vec4};
use materials::Textures;
use parse::{Corner, NONE, Obj, Part};
use std::{
    borrow::Cow,
    collections::{HashMap, HashSet},
    path::Path,
};

/// Edges flatter than this are smooth where normals are missing: 45° in radians.
const CREASE: f32 = std::f32::consts::FRAC_PI_4;

/// Reads the scene in `bytes`, the content of the file `path`, whose unit is `unit` metres.
pub(crate) fn read(path: &Path, folder: &Folder, bytes: &[u8], unit: f32, limits: &Limits) -> Result<Scene> {
    let budget = Budget::new(limits);
    budget.read(bytes.len());
    let text = decode_text(bytes);
    let obj = parse::parse(&text, &budget)?;
    let mut notes = Notes::default();
    if obj.positions.is_empty() {
        return Err(Error::input("has no vertices").help("The file is empty or no OBJ file"));
    }
    for (keyword, count) in &obj.skipped {
        notes.ignored(keyword.as_str(), format!("{count} elements are not drawn; only faces are"));
    }
    let (mut materials, textures) = read_materials(&obj, folder, limits, &budget, &mut notes)?;
    let mut meshes = read_meshes(&obj, &materials, &budget, &mut notes)?;
    surface::drop_unused_default(&mut materials, &meshes);
    solid::tell_apart(&mut meshes, &mut materials, &mut notes);
    let local = Transform::Trs { translation: Vec3::ZERO, rotation: Quat::IDENTITY, scale: Vec3::splat(unit) };
    let nodes = meshes
        .iter()
        .enumerate()
        .map(|(i, mesh)| Node { name: mesh.name.clone(), mesh: Some(i as u32), local, ..Node::default() })
        .collect();
    Ok(Scene {
        name: path.file_stem().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default(),
        nodes,
        meshes,
        materials,
        textures,
        notes: notes.finish(),
        ..Scene::default()
    })
}

/// UTF-8, or UTF-16 with a byte-order mark. Names in other encodings keep their ASCII letters.
fn decode_text(bytes: &[u8]) -> Cow<'_, str> {
    let wide = |rest: &[u8], unit: fn([u8; 2]) -> u16| {
        let units = rest.chunks_exact(2).map(|pair| unit([pair[0], pair[1]]));
        Cow::Owned(char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER)).collect())
    };
    match bytes {
        [0xff, 0xfe, rest @ ..] => wide(rest, u16::from_le_bytes),
        [0xfe, 0xff, rest @ ..] => wide(rest, u16::from_be_bytes),
        [0xef, 0xbb, 0xbf, rest @ ..] => String::from_utf8_lossy(rest),
        _ => String::from_utf8_lossy(bytes),
    }
}

/// The used materials in order, then a grey one for faces without.
fn read_materials(
    obj: &Obj,
    folder: &Folder,
    limits: &Limits,
    budget: &Budget,
    notes: &mut Notes,
) -> Result<(Vec<Material>, Vec<super::Texture>)> {
    let mut known = HashMap::new();
    let mut read = HashSet::new();
    for (name, line) in &obj.libraries {
        let place = format!("line {line}");
        let path = match find_library(folder, name) {
            Ok(path) => path,
            Err(error) => {
                notes.ignored(place, format!("material file {:?} is not read: {error}", shorten(name)));
                continue;
            }
        };
        if !read.insert(path.clone()) {
            continue;
        }
        let bytes = folder.read(&path, limits.max_file.min(limits.max_alloc))?;
        budget.read(bytes.len());
        budget.take(bytes.len() as u64, 16)?;
        let library = mtl::parse(&decode_text(&bytes)).map_err(|error| error.in_file(&path))?;
        for material in library {
            known.entry(material.name.clone()).or_insert((material, path.clone()));
        }
    }
    let mut textures = Textures { folder, limits, budget, notes, textures: Vec::new(), known: HashMap::new() };
    let mut out = Vec::with_capacity(obj.materials.len() + 1);
    let mut missing = Vec::new();
    for name in &obj.materials {
        out.push(match known.get(name) {
            Some((mtl, path)) => textures.material(mtl).map_err(|error| error.in_file(path))?,
            None => {
                missing.push(format!("{:?}", shorten(name)));
                grey(name)
            }
        });
    }
    out.push(grey("default"));
    let textures = textures.textures;
    if !missing.is_empty() {
        let names = missing[..missing.len().min(8)].join(", ");
        let more = if missing.len() > 8 { ", …" } else { "" };
        let text = format!("{} are in no material file, grey stands in: {names}{more}", missing.len());
        notes.approximated("usemtl", text);
    }
    if out.len() > 1 && !known.is_empty() {
        notes.approximated("materials", "Phong materials are converted to metallic-roughness");
    }
    Ok((out, textures))
}

fn find_library(folder: &Folder, name: &str) -> Result<std::path::PathBuf> {
    let name = name.trim_matches('"');
    materials::find(folder, name)
}

/// OBJ does not say which sides are seen: both.
fn grey(name: &str) -> Material {
    Material { double_sided: true, ..Material::diffuse(name, Vec3::splat(0.6)) }
}

/// One mesh a group, one primitive a material in it.
fn read_meshes(obj: &Obj, materials: &[Material], budget: &Budget, notes: &mut Notes) -> Result<Vec<Mesh>> {
    let mut meshes: Vec<Mesh> = Vec::new();
    let mut group = None;
    for part in &obj.parts {
        let Some(primitive) = primitive(obj, part, materials, budget, notes)? else { continue };
        if group.replace(part.group) != Some(part.group) {
            meshes.push(Mesh { name: part.name.clone(), ..Mesh::default() });
        }
        if let Some(mesh) = meshes.last_mut() {
            mesh.primitives.push(primitive);
        }
    }
    Ok(meshes)
}

fn primitive(
    obj: &Obj,
    part: &Part,
    materials: &[Material],
    budget: &Budget,
    notes: &mut Notes,
) -> Result<Option<Primitive>> {
    let material = part.material.unwrap_or(materials.len() - 1);
    let has_uvs =
        part.corners.iter().any(|corner| corner.uv != NONE) || materials[material].textures().next().is_some();
    let mut out = Primitive { material: material as u32, ..Primitive::default() };
    if has_uvs {
        out.uvs.push(Vec::new());
    }
    let mut known: HashMap<Corner, u32> = HashMap::with_capacity(part.corners.len() / 3);
    for &corner in &part.corners {
        let index = *known.entry(corner).or_insert_with(|| {
            let position = corner.position as usize;
            out.positions.push(obj.positions[position]);
            // Zero: to be computed.
            out.normals.push(obj.normals.get(corner.normal as usize).copied().unwrap_or(Vec3::ZERO));
            if let Some(uvs) = out.uvs.first_mut() {
                uvs.push(obj.uvs.get(corner.uv as usize).copied().unwrap_or_default());
            }
            if !obj.colors.is_empty() {
                out.colors.push(obj.colors.get(position).copied().unwrap_or(Vec4::ONE));
            }
            out.positions.len() as u32 - 1
        });
        out.indices.push(index);
    }
    let dropped = out.drop_degenerate_triangles();
    if dropped > 0 {
        notes.repaired(part.name.as_str(), format!("{dropped} triangles without area dropped"));
    }
    if out.indices.is_empty() {
        return Ok(None);
    }
    supply_normals(&mut out);
    out.repair_normals();
    match &materials[material].normal_texture {
        Some(_) => {
            budget.take(out.indices.len() as u64, 200)?;
            out.make_tangents(0);
        }
        None => out.tangents = vec![Vec4::ZERO; out.positions.len()],
    }
    Ok(Some(out))
}

/// Computes the normals that the file leaves out, which are zero.
fn supply_normals(primitive: &mut Primitive) {
    if primitive.normals.iter().all(|&normal| normal != Vec3::ZERO) {
        return;
    }
    let computed = normals::creased(&primitive.positions, &primitive.indices, CREASE);
    primitive.gather_vertices(&computed.source);
    primitive.indices = computed.indices;
    for (normal, computed) in primitive.normals.iter_mut().zip(computed.normals) {
        if *normal == Vec3::ZERO {
            *normal = computed;
        }
    }
}
