//! Surfaces as `mesh2`, deformed and placed.

use std::{collections::HashMap, fmt::Write};

use glam::{Vec2, Vec3, Vec4};
use lucerna::scene::{
    Pose, Primitive, Scene, View,
    deform::{Vertices, world_vertices},
};

use super::{
    material::{Look, plain, texture_uv},
    text::{comment, number, vector},
};

/// Maximum of vertex colours that are exported as separate textures.
const MAX_COLORS: usize = 4096;

/// All surfaces of the scene.
pub fn all(
    out: &mut String,
    scene: &Scene,
    pose: &Pose,
    view: &View,
    units: f32,
    looks: &[Look],
    notes: &mut Vec<String>,
) {
    for (index, node) in scene.nodes.iter().enumerate() {
        let Some(mesh) = node.mesh.and_then(|mesh| scene.meshes.get(mesh as usize)) else { continue };
        for primitive in &mesh.primitives {
            let Some(look) = looks.get(primitive.material as usize) else { continue };
            let vertices = world_vertices(scene, pose, index, primitive);
            let name = if mesh.name.is_empty() { &node.name } else { &mesh.name };
            let colors = colors(primitive, look, name, notes);
            let [seen, hidden] = sides(primitive, &vertices, view, look.double_sided);
            for (triangles, flag) in [(seen, ""), (hidden, " no_image")] {
                if !triangles.is_empty() {
                    let _ = writeln!(out, "// {}", comment(name));
                    mesh2(out, primitive, &vertices, &triangles, units, look, &colors, flag);
                }
            }
        }
    }
}

/// Triangles that the camera sees, and back-facing single-sided triangles, which a rasteriser does not draw.
fn sides(primitive: &Primitive, vertices: &Vertices, view: &View, double_sided: bool) -> [Vec<[u32; 3]>; 2] {
    let [.., forward] = view.axes();
    let mut out = [Vec::new(), Vec::new()];
    for corners in primitive.indices.chunks_exact(3) {
        let corners = [corners[0], corners[1], corners[2]];
        let [a, b, c] = corners.map(|i| vertices.positions[i as usize]);
        if !(a.is_finite() && b.is_finite() && c.is_finite()) {
            continue;
        }
        let normal = (b - a).cross(c - a);
        let shading: Vec3 = corners.iter().map(|&i| vertices.normals[i as usize]).sum();
        let front = if normal.dot(shading) < 0.0 { -normal } else { normal };
        let along = if view.is_orthographic() { forward } else { a - view.position };
        out[usize::from(!double_sided && front.dot(along) > 0.0)].push(corners);
    }
    out
}

/// The export of vertex colours.
enum Colors {
    None,
    /// Textures, and the one of every vertex.
    List(Vec<Vec4>, Vec<u32>),
}

fn colors(primitive: &Primitive, look: &Look, name: &str, notes: &mut Vec<String>) -> Colors {
    let Some(first) = primitive.colors.first() else { return Colors::None };
    if *first == Vec4::ONE && primitive.colors.iter().all(|c| c == first) {
        return Colors::None;
    }
    let Some(base) = look.plain else {
        notes.push(format!("mesh {name:?}: vertex colours are left out, its material is not of one matt colour"));
        return Colors::None;
    };
    // 8 bits a channel, finer where it is dark.
    let code = |c: Vec4| c.to_array().map(|x| (x.clamp(0.0, 1.0).sqrt() * 255.0).round() as u8);
    let mut known = HashMap::new();
    let mut list = Vec::new();
    let mut each = Vec::new();
    for color in &primitive.colors {
        let next = list.len() as u32;
        each.push(*known.entry(code(*color)).or_insert_with(|| {
            list.push(base * *color);
            next
        }));
    }
    if list.len() > MAX_COLORS {
        notes.push(format!("mesh {name:?} has {} vertex colours: their mean is used", list.len()));
        let mean = primitive.colors.iter().sum::<Vec4>() / primitive.colors.len() as f32;
        return Colors::List(vec![base * mean], vec![0; each.len()]);
    }
    Colors::List(list, each)
}

#[allow(clippy::too_many_arguments)]
fn mesh2(
    out: &mut String,
    primitive: &Primitive,
    vertices: &Vertices,
    triangles: &[[u32; 3]],
    units: f32,
    look: &Look,
    colors: &Colors,
    flag: &str,
) {
    // Only the vertices that these triangles use, in the order of their first use.
    let mut new = HashMap::new();
    let mut used = Vec::new();
    for &corner in triangles.iter().flatten() {
        new.entry(corner).or_insert_with(|| {
            used.push(corner as usize);
            used.len() - 1
        });
    }
    out.push_str("mesh2 {\n");
    list(out, "vertex_vectors", used.iter().map(|&i| vector(vertices.positions[i] * units)));
    list(out, "normal_vectors", used.iter().map(|&i| vector(vertices.normals[i])));
    if let Some(texture) = &look.uv {
        // The image's v runs upwards there.
        let uv = |i: usize| texture_uv(primitive, texture, i);
        let text = |uv: Vec2| format!("<{},{}>", number(uv.x), number(1.0 - uv.y));
        list(out, "uv_vectors", used.iter().map(|&i| text(uv(i))));
    }
    if let Colors::List(colors, _) = colors {
        let texture = |c: &Vec4| plain(c.truncate(), 0.0, 1.0 - c.w.clamp(0.0, 1.0), &look.finish);
        list(out, "texture_list", colors.iter().map(texture));
    }
    let face = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(|i| new[&i]);
        match colors {
            Colors::None => format!("<{a},{b},{c}>"),
            Colors::List(_, each) => {
                let [r, s, t] = corners.map(|i| each[i as usize]);
                format!("<{a},{b},{c}>,{r},{s},{t}")
            }
        }
    };
    list(out, "face_indices", triangles.iter().map(face));
    if matches!(colors, Colors::None) {
        let _ = writeln!(out, "  {}", look.texture);
    }
    let _ = writeln!(out, "  {}{}{}\n}}", look.interior, look.flags, flag);
}

fn list(out: &mut String, name: &str, items: impl ExactSizeIterator<Item = String>) {
    let _ = write!(out, "  {name} {{ {}", items.len());
    for (i, item) in items.enumerate() {
        out.push_str(if i % 8 == 0 { ",\n    " } else { ", " });
        out.push_str(&item);
    }
    out.push_str(" }\n");
}
