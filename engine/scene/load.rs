//! From a file name to a scene.

use super::{Limits, Note, NoteKind, Scene, archive, c_arrays, folder, gltf, obj};
use crate::{Error, Result};
use std::{path::Path, rc::Rc};

/// How scene files are read.
#[derive(Clone, Debug, Default)]
pub struct LoadOptions {
    /// What a file may ask for.
    pub limits: Limits,
    /// Metres that one unit of the file stands for, in formats that leave it open (OBJ, C arrays); 1 if not given, but
    /// 0.003 for the Conference room. glTF files are always in metres.
    pub unit: Option<f32>,
}

/// Reads a scene file: glTF 2.0 (`.gltf`, `.glb`), OBJ (`.obj`), two C arrays ([`c_arrays`]), or a `.zip` with one of them. The content
/// decides, and where it leaves the format open, the extension.
///
/// Only files in the scene's own folder and below it are read. Every index of the result is valid and every number
/// finite ([`Scene::validate`]). What could not be read as the file means it stands in [`Scene::notes`].
///
/// # Errors
/// [`ErrorKind::Input`](crate::ErrorKind::Input), with the file and the place in it, for anything that is unreadable,
/// malformed, over a limit, or needs an extension that is not supported.
pub fn load(path: impl AsRef<Path>, options: &LoadOptions) -> Result<Scene> {
    let path = path.as_ref();
    read(path, options).map_err(|error| error.in_file(path))
}

fn read(path: &Path, options: &LoadOptions) -> Result<Scene> {
    if let Some(unit) = options.unit.filter(|unit| !(unit.is_finite() && *unit > 0.0)) {
        return Err(Error::usage(format!("a unit of {unit} m, it must be above 0")));
    }
    if path.is_dir() {
        return Err(Error::input("is a folder").help(match scene_in(path) {
            Some(name) => format!("Name the scene file in it, for example {name}"),
            None => "Name a .gltf, .glb or .obj file".to_owned(),
        }));
    }
    let head = folder::read_head(path, 4096)?;
    if head.starts_with(archive::MAGIC) {
        return read_packed(path, options);
    }
    let format = format(path, &head)?;
    // Text is parsed as a whole in memory; the binary format may be larger.
    let limits = &options.limits;
    let limit = if gltf::is_glb(&head) { limits.max_file } else { limits.max_file.min(limits.max_alloc) };
    let bytes = folder::read_file(path, "the file", limit)?;
    parsed(path, &folder::Folder::of(path)?, (format, &bytes), options)
}

/// Reads the scene in an archive.
fn read_packed(path: &Path, options: &LoadOptions) -> Result<Scene> {
    let archive = Rc::new(archive::Archive::open(path)?);
    let inside = archive.scene(|path| extension(path).is_some())?;
    let limits = &options.limits;
    let bytes = archive.read(&inside, limits.max_file.min(limits.max_alloc))?;
    let format = format(&inside, &bytes[..bytes.len().min(4096)])?;
    let folder = folder::Folder::in_archive(archive, &inside);
    parsed(&inside, &folder, (format, &bytes), options).map_err(|error| match error.file() {
        Some(_) => error,
        None => error.at(inside.display().to_string()),
    })
}

fn parsed(
    path: &Path,
    folder: &folder::Folder,
    (format, bytes): (Format, &[u8]),
    options: &LoadOptions,
) -> Result<Scene> {
    let scene = match format {
        Format::Gltf => {
            let mut scene = gltf::read(path, folder, bytes, &options.limits)?;
            if options.unit.is_some() {
                let text = "has no effect: glTF files are in metres".into();
                scene.notes.push(Note { kind: NoteKind::Ignored, place: "unit".into(), text });
            }
            scene
        }
        Format::Obj => obj::read(path, folder, bytes, options.unit.unwrap_or(1.0), &options.limits)?,
        Format::Arrays => {
            c_arrays::read(bytes, options.unit.unwrap_or_else(|| c_arrays::usual_unit(bytes)), &options.limits)?
        }
    };
    scene.validate()?;
    Ok(scene)
}

/// Name of a scene file in a folder, the first one in alphabetical order.
fn scene_in(folder: &Path) -> Option<String> {
    let names = folder.read_dir().ok()?.flatten().map(|entry| entry.file_name().to_string_lossy().into_owned());
    names.filter(|name| extension(Path::new(name)).is_some()).min()
}

enum Format {
    Gltf,
    Obj,
    Arrays,
}

fn extension(path: &Path) -> Option<Format> {
    match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
        "gltf" | "glb" => Some(Format::Gltf),
        "obj" => Some(Format::Obj),
        _ => None,
    }
}

/// The format of a file that begins with `head`.
fn format(path: &Path, head: &[u8]) -> Result<Format> {
    let text = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head);
    if gltf::is_glb(head) || text.trim_ascii_start().starts_with(b"{") {
        return Ok(Format::Gltf);
    }
    if c_arrays::recognise(head) {
        return Ok(Format::Arrays);
    }
    let none = |what: &str| {
        Err(Error::input(what).help("Scenes are .gltf and .glb (glTF 2.0) and .obj files, also in a .zip"))
    };
    let wide = head.starts_with(b"\xff\xfe") || head.starts_with(b"\xfe\xff");
    match extension(path) {
        None => none("is no scene file that can be read"),
        Some(_) if head.contains(&0) && !wide => none("is neither text nor a GLB container"),
        Some(format) => Ok(format),
    }
}
