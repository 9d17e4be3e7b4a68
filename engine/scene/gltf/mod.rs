//! glTF 2.0: text and binary files, with the extensions of [`SUPPORTED`].
//!
//! Its own front end. A scene file is data from elsewhere: nothing outside its folder is read, sizes are checked before
//! memory is taken, and every index, offset and number before it is used. No input makes it panic.

mod accessors;
mod buffers;
mod container;
mod data_uri;
mod document;
mod geometry;
mod materials;
mod meshopt;
mod motion;
mod nodes;
mod types;

pub(crate) use container::is_glb;

use super::{Limits, Scene, budget::Budget, folder::Folder, notes::Notes, surface};
use crate::{Error, Result};
use document::Document;
use std::path::Path;

/// Extensions that are read. A file that requires another one is refused; one that only uses it gets a note.
pub const SUPPORTED: &[&str] = &[
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_mesh_quantization",
    "KHR_texture_basisu",
    "KHR_texture_transform",
];

/// Reads the scene in `bytes`, the content of the file `path`.
pub(crate) fn read(path: &Path, folder: &Folder, bytes: &[u8], limits: &Limits) -> Result<Scene> {
    let budget = Budget::new(limits);
    budget.read(bytes.len());
    let parts = container::split(bytes)?;
    let document = Document::parse(parts.json, limits)?;
    let mut notes = Notes::default();
    check_extensions(&document, &mut notes)?;
    let buffers = buffers::Buffers::read(&document, parts.bin, folder, limits, &budget)?;
    let accessors = accessors::Accessors { document: &document, buffers: &buffers, budget: &budget };
    buffers.check_views()?;
    accessors.check_all()?;
    let hierarchy = nodes::read(&document, limits, &mut notes)?;
    let cameras = nodes::cameras(&document)?;
    let lights = nodes::lights(&document, &mut notes)?;
    let skins = motion::skins(&accessors, &hierarchy)?;
    let animations = motion::animations(&accessors, &hierarchy, &mut notes)?;

    let mut reader = materials::Materials {
        document: &document,
        buffers: &buffers,
        folder,
        limits,
        budget: &budget,
        notes: &mut notes,
        textures: Vec::new(),
        of_image: vec![None; document.images.len()],
    };
    let mut materials = reader.read_all()?;
    let textures = std::mem::take(&mut reader.textures);

    let mut reader = geometry::Meshes { accessors: &accessors, materials: &materials, notes: &mut notes };
    let mut meshes = Vec::with_capacity(document.meshes.len());
    for i in 0..document.meshes.len() {
        meshes.push(reader.mesh(i)?);
    }
    surface::drop_unused_default(&mut materials, &meshes);
    Ok(Scene {
        name: path.file_stem().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default(),
        nodes: hierarchy.nodes,
        meshes,
        materials,
        textures,
        lights,
        cameras,
        skins,
        animations,
        environment: None,
        added: None,
        notes: notes.finish(),
    })
}

fn check_extensions(document: &Document, notes: &mut Notes) -> Result<()> {
    for (i, name) in document.extensions_required.iter().enumerate() {
        if !SUPPORTED.contains(&name.as_str()) {
            return Err(Error::input(format!("the file requires the extension {name:?}, which is not supported"))
                .at(format!("extensionsRequired[{i}]"))
                .help(match name.as_str() {
                    "KHR_draco_mesh_compression" => {
                        "Export the file without it, or unpack it: npx @gltf-transform/cli copy in.glb out.glb"
                    }
                    _ => "Export the file without it",
                }));
        }
    }
    for name in &document.extensions_used {
        if !SUPPORTED.contains(&name.as_str()) {
            notes.ignored("extensionsUsed", format!("{name} is not supported and left out"));
        }
    }
    Ok(())
}
