//! Environments from files: what layout a picture has, and what is wrong with its numbers.

use std::path::{Path, PathBuf};

use glam::Vec3;

use super::{Cube, Face};
use crate::{
    Error, Result,
    image::{self, Layers, check_size},
    scene::{Environment, Limits, Note, NoteKind},
};

/// The largest 16-bit value, which replaces infinity.
const LARGEST: f32 = 65504.0;

/// Reads an environment from a file (.hdr, .exr, .pfm) or from a folder with six faces (`px.hdr`, `nx.hdr`, … or
/// `posx.exr`, `negx.exr`, …).
///
/// Layouts: latitude-longitude (2 : 1), cube as a strip (6 : 1 or 1 : 6, px nx py ny pz nz), as a cross (4 : 3, or 3 : 4
/// with the back upside down at the bottom), and whatever the `envmap` attribute of an EXR file says. Cubes become
/// latitude-longitude images. Notes say what was repaired.
pub fn load(path: &Path, limits: &Limits) -> Result<(Environment, Vec<Note>)> {
    let name = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    if path.is_dir() {
        return load_folder(path, limits)
            .and_then(|cube| finish_cube(&cube, name, limits))
            .map_err(|e| e.in_file(path));
    }
    let picture = image::read(path, &half(limits))?;
    from_picture(&picture, name, limits).map_err(|error| error.in_file(path))
}

/// As [`load`], for a file in memory.
pub fn decode(bytes: &[u8], name: impl Into<String>, limits: &Limits) -> Result<(Environment, Vec<Note>)> {
    from_picture(&image::decode(bytes, &half(limits))?, name, limits)
}

/// As [`load`], for a picture that is read already.
pub fn from_picture(picture: &Layers, name: impl Into<String>, limits: &Limits) -> Result<(Environment, Vec<Note>)> {
    let name = name.into();
    let (w, h) = (picture.width, picture.height);
    let envmap = picture.metadata.extra.get("envmap").map(String::as_str);
    let pixels = pixels(picture)?;
    let latlong = |name, pixels| {
        let (pixels, notes) = repair(pixels, w);
        Ok((Environment { name, width: w, height: h, pixels, rotation: 0.0, scale: 1.0 }, notes))
    };
    let squares =
        |columns: u32, rows: u32| w.checked_mul(rows) == h.checked_mul(columns) && w % columns == 0 && h % rows == 0;
    match envmap {
        Some("latlong") => return latlong(name, pixels),
        Some("cube") if squares(1, 6) => return finish_cube(&openexr_cube(&pixels, w), name, limits),
        Some("cube") => return Err(Error::input(format!("{w}×{h} pixels said to be a cube, which is 1 : 6"))),
        _ => {}
    }
    let cut = |size: u32, at: &dyn Fn(Face) -> (u32, u32)| {
        Face::ALL.map(|face| {
            let (column, row) = at(face);
            let line = |y: u32| ((row * size + y) * w + column * size) as usize;
            let rows = (0..size).flat_map(|y| &pixels[line(y)..line(y) + size as usize]);
            rows.copied().collect::<Vec<_>>()
        })
    };
    // Column and row of each face of a cross; the two kinds differ in where the back is.
    let cross = |back| {
        move |face| match face {
            Face::Px => (2, 1),
            Face::Nx => (0, 1),
            Face::Py => (1, 0),
            Face::Ny => (1, 2),
            Face::Pz => (1, 1),
            Face::Nz => back,
        }
    };
    let cube = |size, faces| Cube { size, faces, edge_centred: false };
    if squares(2, 1) {
        latlong(name, pixels)
    } else if squares(6, 1) {
        finish_cube(&cube(h, cut(h, &|face| (face as u32, 0))), name, limits)
    } else if squares(1, 6) {
        finish_cube(&cube(w, cut(w, &|face| (0, face as u32))), name, limits)
    } else if squares(4, 3) {
        finish_cube(&cube(h / 3, cut(h / 3, &cross((3, 1)))), name, limits)
    } else if squares(3, 4) {
        let mut faces = cut(w / 3, &cross((1, 3)));
        // Folded up from below, the back stands on its head.
        faces[Face::Nz as usize].reverse();
        finish_cube(&cube(w / 3, faces), name, limits)
    } else {
        Err(Error::input(format!("{w}×{h} pixels are no environment")).help(
            "Latitude-longitude images are 2 : 1, cubes 6 : 1 or 1 : 6 (strips), 4 : 3 or 3 : 4 (crosses) or six files in a folder",
        ))
    }
}

/// The picture and the environment that is made of it stand side by side.
fn half(limits: &Limits) -> Limits {
    Limits { max_alloc: limits.max_alloc / 2, ..limits.clone() }
}

fn pixels(picture: &Layers) -> Result<Vec<Vec3>> {
    let layer = picture.main().ok_or_else(|| Error::input("no pixels"))?;
    let rgb = layer.rgb_pixels().ok_or_else(|| {
        Error::input(format!("channels {}, an environment has R G B or one channel", layer.channels.join(" ")))
    })?;
    Ok(rgb.into_iter().map(Vec3::from_array).collect())
}

/// OpenEXR's cube: +X −X +Y −Y +Z −Z from the top, outer pixels on the edges; its world is ours turned by half a turn
/// about Y, because the centre of its latitude-longitude images looks to +Z. So the same surroundings give the same
/// environment in both forms.
fn openexr_cube(pixels: &[Vec3], size: u32) -> Cube {
    let face = |k: usize| {
        let count = size as usize * size as usize;
        pixels[k * count..(k + 1) * count].to_vec()
    };
    // Half a turn swaps opposite sides; top and bottom turn in their plane.
    let turned = |k: usize| {
        let mut pixels = face(k);
        pixels.reverse();
        pixels
    };
    Cube { size, faces: [face(1), face(0), turned(2), turned(3), face(4), face(5)], edge_centred: true }
}

fn load_folder(folder: &Path, limits: &Limits) -> Result<Cube> {
    let find = |names: [&str; 2]| -> Result<PathBuf> {
        let candidates =
            names.iter().flat_map(|name| ["hdr", "exr", "pfm"].map(|end| folder.join(format!("{name}.{end}"))));
        candidates.into_iter().find(|path| path.is_file()).ok_or_else(|| {
            Error::input(format!("no face {} or {}", names[0], names[1]))
                .help("A folder holds px, nx, py, ny, pz and nz as .hdr, .exr or .pfm")
        })
    };
    let names = [["px", "posx"], ["nx", "negx"], ["py", "posy"], ["ny", "negy"], ["pz", "posz"], ["nz", "negz"]];
    let mut size = 0;
    let mut faces: [Vec<Vec3>; 6] = Default::default();
    for (face, names) in faces.iter_mut().zip(names) {
        let path = find(names)?;
        let picture = image::read(&path, limits)?;
        let (w, h) = (picture.width, picture.height);
        if w != h || (size != 0 && w != size) {
            let needed = if size == 0 { "a square".to_owned() } else { format!("{size}×{size}") };
            return Err(Error::input(format!("{w}×{h} pixels, {needed} is needed")).in_file(path));
        }
        size = w;
        *face = pixels(&picture).map_err(|error| error.in_file(path))?;
    }
    Ok(Cube { size, faces, edge_centred: false })
}

fn finish_cube(cube: &Cube, name: String, limits: &Limits) -> Result<(Environment, Vec<Note>)> {
    check_size(4 * u64::from(cube.size), 2 * u64::from(cube.size), size_of::<Vec3>() as u64, limits)?;
    let mut notes = Vec::new();
    let faces = cube.faces.clone().map(|pixels| {
        let (pixels, mut found) = repair(pixels, cube.size);
        notes.append(&mut found);
        pixels
    });
    notes.dedup_by(|a, b| a.text == b.text);
    Ok((Cube { faces, ..*cube }.to_latlong(name), notes))
}

/// NaN and negative radiance become 0, infinity the largest 16-bit value; a note says how many and where.
fn repair(mut pixels: Vec<Vec3>, width: u32) -> (Vec<Vec3>, Vec<Note>) {
    let (mut nan, mut infinite, mut negative) = (0u64, 0u64, 0u64);
    let mut first = None;
    for (i, pixel) in pixels.iter_mut().enumerate() {
        for value in pixel.as_mut() {
            let (count, repaired) = match *value {
                v if v.is_nan() => (&mut nan, 0.0),
                v if v.is_infinite() && v > 0.0 => (&mut infinite, LARGEST),
                v if v < 0.0 => (&mut negative, 0.0),
                _ => continue,
            };
            *count += 1;
            *value = repaired;
            first.get_or_insert(i);
        }
    }
    let Some(first) = first else { return (pixels, vec![]) };
    let (x, y) = (first % width.max(1) as usize, first / width.max(1) as usize);
    let text = format!(
        "{nan} samples that are no number and {negative} negative ones became 0, {infinite} infinite ones {LARGEST}; \
         the first in pixel ({x}, {y})"
    );
    (pixels, vec![Note { kind: NoteKind::Repaired, place: "environment".into(), text }])
}
