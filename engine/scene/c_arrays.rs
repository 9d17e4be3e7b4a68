//! Bare triangle meshes written as two C arrays, the way the Conference scene is handed on:
//! `float NAME_vertices[] = { x, y, z, … };` and `unsigned int NAME_indices[] = { a, b, c, … };`.
//!
//! The format has no unit, no normals and no materials: the scene gets creased normals and one white diffuse material.

use super::{Limits, Material, Mesh, Node, Note, NoteKind, Primitive, Scene, Transform, normals};
use crate::{Error, Result};
use glam::{Quat, Vec3, Vec4};

/// Faces that meet at less than this angle (radians, 35°) are shaded as one smooth surface.
const CREASE: f32 = 35.0 * std::f32::consts::PI / 180.0;

/// Whether `bytes` start like such a file.
pub fn recognise(bytes: &[u8]) -> bool {
    let start = String::from_utf8_lossy(&bytes[..bytes.len().min(256)]);
    let mut words = start.split_whitespace();
    let words: Vec<&str> = match words.next() {
        Some("static" | "const") => words.collect(),
        Some(first) => std::iter::once(first).chain(words).collect(),
        None => return false,
    };
    words.first() == Some(&"float") && start.contains("[]") && start.contains('=')
}

/// Metres of one unit of meshes that are known by the name of their first array; 1 for others. Conference was modelled
/// in units of 3 mm.
pub fn usual_unit(bytes: &[u8]) -> f32 {
    let start = String::from_utf8_lossy(&bytes[..bytes.len().min(256)]);
    if start.contains("conference_vertices") { 0.003 } else { 1.0 }
}

/// Reads the file; one unit becomes `scale` metres.
pub fn read(bytes: &[u8], scale: f32, limits: &Limits) -> Result<Scene> {
    let text = std::str::from_utf8(bytes).map_err(|e| at_byte(bytes, e.valid_up_to(), "is not UTF-8 text"))?;
    let (name, numbers, rest) = array(text, 0, limits, |word| word.parse::<f32>().ok().filter(|x| x.is_finite()))?;
    let (_, indices, _) = array(text, rest, limits, |word| word.trim_end_matches(['u', 'U']).parse::<u32>().ok())?;
    if numbers.len() % 3 != 0 || indices.len() % 3 != 0 {
        return Err(Error::input(format!(
            "holds {} coordinates and {} indices; both must be multiples of three",
            numbers.len(),
            indices.len()
        )));
    }
    let positions: Vec<Vec3> = numbers.chunks_exact(3).map(|p| Vec3::new(p[0], p[1], p[2])).collect();
    if let Some(place) = indices.iter().position(|&i| i as usize >= positions.len()) {
        let (bad, count) = (indices[place], positions.len());
        return Err(Error::input(format!("is {bad}, but there are {count} vertices")).at(format!("indices[{place}]")));
    }
    scene(name.trim_end_matches("_vertices"), &positions, &indices, scale)
}

fn scene(name: &str, positions: &[Vec3], indices: &[u32], scale: f32) -> Result<Scene> {
    let kept: Vec<u32> = indices.chunks_exact(3).filter(|t| has_area(positions, t)).flatten().copied().collect();
    if kept.is_empty() {
        return Err(Error::input("holds no triangle with an area"));
    }
    let mesh = normals::creased(positions, &kept, CREASE);
    let count = mesh.source.len();
    let primitive = Primitive {
        positions: mesh.source.iter().map(|&i| positions[i as usize]).collect(),
        normals: mesh.normals,
        tangents: vec![Vec4::ZERO; count],
        indices: mesh.indices,
        ..Primitive::default()
    };
    let mut notes = vec![Note {
        kind: NoteKind::Approximated,
        place: "file".into(),
        text: "the format has no normals and no materials: normals creased at 35°, one diffuse material of albedo 0.7"
            .into(),
    }];
    let dropped = (indices.len() - kept.len()) / 3;
    if dropped > 0 {
        let text = format!("{dropped} triangles without area dropped");
        notes.push(Note { kind: NoteKind::Repaired, place: "indices".into(), text });
    }
    let local = Transform::Trs { translation: Vec3::ZERO, rotation: Quat::IDENTITY, scale: Vec3::splat(scale) };
    Ok(Scene {
        name: name.to_owned(),
        nodes: vec![Node { name: name.to_owned(), local, mesh: Some(0), ..Node::default() }],
        meshes: vec![Mesh { name: name.to_owned(), primitives: vec![primitive], ..Mesh::default() }],
        // Such meshes come with no rule about winding.
        materials: vec![Material { double_sided: true, ..Material::diffuse("plaster", Vec3::splat(0.7)) }],
        notes,
        ..Scene::default()
    })
}

fn has_area(positions: &[Vec3], t: &[u32]) -> bool {
    let [a, b, c] = [t[0], t[1], t[2]].map(|i| positions[i as usize]);
    (b - a).cross(c - a).length_squared() > 0.0
}

/// Reads `… NAME[] = { n, n, … }` from byte `from` on: the name, the numbers and where to go on.
fn array<T>(
    text: &str,
    from: usize,
    limits: &Limits,
    number: impl Fn(&str) -> Option<T>,
) -> Result<(String, Vec<T>, usize)> {
    let rest = &text[from..];
    let missing = |what: &str| at_byte(text.as_bytes(), from, &format!("expected {what}"));
    let open = rest.find('{').ok_or_else(|| missing("an array `type name[] = { … };`"))?;
    let close = open + rest[open..].find('}').ok_or_else(|| missing("the closing `}` of this array"))?;
    let head = rest[..open].split(['[', '=']).next().unwrap_or_default();
    let name = head.split_whitespace().last().unwrap_or("mesh").trim_start_matches(';').to_owned();
    let most = limits.max_vertices.saturating_mul(3);
    let mut values = Vec::new();
    let mut place = open + 1;
    for word in rest[open + 1..close].split(',') {
        let trimmed = word.trim();
        if !trimmed.is_empty() {
            let bare = trimmed.strip_suffix(['f', 'F']).unwrap_or(trimmed);
            let value = number(bare).ok_or_else(|| {
                let shown: String = trimmed.chars().take(20).collect();
                at_byte(text.as_bytes(), from + place, &format!("`{shown}` is not a usable number here"))
            })?;
            if values.len() as u64 >= most {
                return Err(Error::input(format!("has more than {most} numbers in `{name}`"))
                    .help("raise the limit on vertices if the file is meant to be that large"));
            }
            values.push(value);
        }
        place += word.len() + 1;
    }
    Ok((name, values, from + close + 1))
}

fn at_byte(bytes: &[u8], offset: usize, what: &str) -> Error {
    let before = &bytes[..offset.min(bytes.len())];
    let line = before.iter().filter(|&&b| b == b'\n').count() + 1;
    Error::input(what.to_owned()).at(format!("line {line}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    const QUAD: &str = "float quad_vertices[] =\n{\n 0, 0, 0, 1e0, 0, 0,\n 1.0f, 1, 0, 0, 1, 0\n};\n\n\
                        unsigned int quad_indices[] =\n{ 0, 1, 2, 0, 2, 3, 1, 1, 1, };\n";

    fn read_text(text: &str) -> Result<Scene> {
        read(text.as_bytes(), 2.0, &Limits::default())
    }

    #[test]
    fn a_small_file_becomes_a_scene() {
        assert!(recognise(QUAD.as_bytes()));
        let scene = read_text(QUAD).unwrap();
        assert_eq!(scene.name, "quad");
        let primitive = &scene.meshes[0].primitives[0];
        assert_eq!((primitive.positions.len(), primitive.indices.len()), (4, 6));
        assert!(primitive.normals.iter().all(|n| *n == Vec3::Z));
        assert!(scene.notes.iter().any(|n| n.text.contains("1 triangles without area")));
        assert_eq!(scene.nodes[0].local.matrix().transform_vector3(Vec3::X), Vec3::X * 2.0);
    }

    #[test]
    fn broken_files_name_the_place() {
        for (from, to, expected) in [
            ("1e0", "1e99", "line 3"),
            ("1e0", "one", "`one` is not a usable number"),
            ("0, 1, 2,", "0, 1, 9,", "indices[2]: is 9, but there are 4 vertices"),
            ("0, 1, 2,", "0, 1, -2,", "line 8"),
            ("1, 1, 1, };", "1, 1, 1,", "closing"),
            ("unsigned int quad_indices[] =\n{", "", "expected an array"),
            ("1e0, ", "", "11 coordinates"),
        ] {
            let text = QUAD.replace(from, to);
            assert_ne!(text, QUAD);
            let message = read_text(&text).unwrap_err().to_string();
            assert!(message.contains(expected), "{from} → {to}: {message}");
        }
        for text in ["", "float", "float x[] = {}; int y[] = {};"] {
            assert!(read_text(text).is_err());
        }
        assert!(read(b"float \xff", 1.0, &Limits::default()).is_err());
    }

    #[test]
    fn the_conference_room_has_its_published_counts() {
        let path = std::path::Path::new(
            &std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_else(|| env!("CARGO_MANIFEST_DIR").into()),
        )
        .join("../shared/assets/scenes/conference/conference.bin");
        if !path.exists() {
            assert!(std::env::var_os("CI").is_none(), "{} is missing", path.display());
            eprintln!("SKIPPED: {} is missing", path.display());
            return;
        }
        let scene = crate::scene::load(&path, &crate::scene::LoadOptions::default()).unwrap();
        assert_eq!(scene.nodes[0].local.matrix().transform_vector3(Vec3::X), Vec3::X * 0.003);
        let triangles = scene.meshes[0].primitives[0].indices.len() / 3;
        // 331,179 triangles, of which 53,627 have no area.
        assert_eq!(triangles, 331_179 - 53_627);
    }

    #[test]
    fn limits_hold() {
        let limits = Limits { max_vertices: 3, ..Limits::default() };
        assert!(read(QUAD.as_bytes(), 1.0, &limits).unwrap_err().to_string().contains("more than 9"));
    }

    #[test]
    fn other_text_is_not_taken() {
        assert!(!recognise(b"# obj\nv 0 0 0\n"));
        assert!(!recognise(b"{\"asset\": {}}"));
        assert!(!recognise(b""));
    }
}
