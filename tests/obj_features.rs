//! What the OBJ reader makes of each feature, on small files made here.

use glam::{Vec2, Vec3, Vec4};
use lucerna::scene::{AlphaMode, LoadOptions, NoteKind, Primitive, Scene, Wrap, load};

/// Loads `text` as `a.obj`, with other files beside it.
fn read(text: &str, files: &[(&str, &[u8])]) -> lucerna::Result<Scene> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.obj"), text).unwrap();
    for (name, content) in files {
        std::fs::write(folder.path().join(name), content).unwrap();
    }
    load(folder.path().join("a.obj"), &LoadOptions::default())
}

fn only(scene: &Scene) -> &Primitive {
    assert_eq!((scene.meshes.len(), scene.meshes[0].primitives.len()), (1, 1));
    &scene.meshes[0].primitives[0]
}

/// A PNG of one row of grey texels.
fn png(row: &[u8]) -> Vec<u8> {
    let mut out = vec![];
    let mut encoder = png::Encoder::new(&mut out, row.len() as u32, 1);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.write_header().unwrap().write_image_data(row).unwrap();
    out
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";

#[test]
fn quads_normals_and_texture_coordinates() {
    let scene = read(&format!("{SQUARE}vn 0 0 2\nf 1/1/1 2/2/1 \\\n 3/3/1 -1/-1/-1 # a comment\n"), &[]).unwrap();
    let primitive = only(&scene);
    assert_eq!(primitive.indices, [0, 1, 2, 0, 2, 3]);
    assert_eq!(primitive.normals, [Vec3::Z; 4]);
    // v runs upwards in the file and downwards in the scene.
    assert_eq!(primitive.uvs[0], [Vec2::new(0.0, 1.0), Vec2::ONE, Vec2::new(1.0, 0.0), Vec2::ZERO]);
}

#[test]
fn vertices_with_weights_and_colours() {
    let scene = read("v 2 0 0 2\nv 0 1 0 1 0.5 0\nv 0 0 1\nf 1 2 3\n", &[]).unwrap();
    let primitive = only(&scene);
    assert_eq!(primitive.positions, [Vec3::X, Vec3::Y, Vec3::Z]);
    assert_eq!(primitive.colors, [Vec4::ONE, Vec4::new(1.0, 0.5, 0.0, 1.0), Vec4::ONE]);
    assert!(primitive.normals.iter().all(|n| n.abs_diff_eq(Vec3::ONE.normalize(), 1e-6)));
}

#[test]
fn groups_become_meshes_and_materials_primitives() {
    let text = format!("{SQUARE}g left\nusemtl a\nf 1 2 3\nusemtl b\nf 1 3 4\ng right\nf 1 2 4\ng empty\n");
    let scene = read(&text, &[]).unwrap();
    let names: Vec<&str> = scene.nodes.iter().map(|node| node.name.as_str()).collect();
    assert_eq!(names, ["left", "right"]);
    let materials = |mesh: usize| scene.meshes[mesh].primitives.iter().map(|p| p.material).collect::<Vec<_>>();
    assert_eq!((materials(0), materials(1)), (vec![0, 1], vec![1]));
    assert_eq!(scene.materials.iter().map(|m| m.name.as_str()).collect::<Vec<_>>(), ["a", "b"]);
    assert!(scene.notes.iter().any(|note| note.text.contains("2 are in no material file")));
}

#[test]
fn materials_are_converted() {
    let mtl = "newmtl plain\nKd .2 .4 .6\nKs .5 .5 .5\nNs 30\nd 0.5\nKe 1 2 3\n\
               newmtl mirror\nillum 3\nKd 0 0 0\nKs .9 .9 .9\n\
               newmtl glass\nillum 7\nNi 1.4\nKd 0 0 0\nTf 1 1 1\n\
               newmtl dull\nillum 1\nKd 1 1 1\nKs 1 1 1\nNs 100\n";
    let faces = "usemtl plain\nf 1 2 3\nusemtl mirror\nf 1 2 3\nusemtl glass\nf 1 2 3\nusemtl dull\nf 1 2 3\n";
    let scene = read(&format!("mtllib m.mtl\n{SQUARE}{faces}"), &[("m.mtl", mtl.as_bytes())]).unwrap();
    let [plain, mirror, glass, dull] = &scene.materials[..] else { panic!("{:?}", scene.materials) };
    assert_eq!(plain.base_color, Vec4::new(0.2, 0.4, 0.6, 0.5));
    assert_eq!((plain.alpha, plain.emissive), (AlphaMode::Blend, Vec3::new(1.0, 2.0, 3.0)));
    // An exponent of 30 is α = sqrt(2 / 32) = 1/4, and roughness its root.
    assert!((plain.roughness - 0.5).abs() < 1e-6);
    assert!(mirror.is_mirror() && mirror.base_color == Vec4::new(0.9, 0.9, 0.9, 1.0));
    assert_eq!((glass.transmission, glass.ior, glass.base_color), (1.0, 1.4, Vec4::ONE));
    assert_eq!((dull.roughness, dull.metallic), (1.0, 0.0));
    assert!(scene.materials.iter().all(|material| material.double_sided));
}

#[test]
fn textures_and_bumps() {
    let mtl = "newmtl a\nmap_Kd -s 2 4 -o 0.25 0.5 -clamp on C:\\work\\my wood.png\nmap_bump -bm 2 bump.png\nmap_Ke gone.png\n";
    let bump = png(&[0, 64, 128, 192, 255, 192, 128, 64]);
    let files = [("m.mtl", mtl.as_bytes()), ("my wood.png", &png(&[7])), ("bump.png", &bump)];
    let text = format!("mtllib m.mtl\n{SQUARE}usemtl a\nf 1/1 2/2 3/3 4/4\n");
    let scene = read(&text, &files).unwrap();
    let material = &scene.materials[0];
    let wood = material.base_color_texture.unwrap();
    assert_eq!(scene.textures[wood.texture as usize].name, "my wood.png");
    assert_eq!(material.base_color, Vec4::ONE);
    assert_eq!(wood.sampler.wrap_u, Wrap::ClampToEdge);
    // Texture coordinates (u, v) with v upwards become (2u + 1/4, 4v + 1/2).
    let [a, b, c, d, x, y] = wood.transform;
    let at = |u: f32, v: f32| (a * u + b * (1.0 - v) + x, 1.0 - (c * u + d * (1.0 - v) + y));
    assert_eq!((at(0.0, 0.0), at(1.0, 1.0)), ((0.25, 0.5), (2.25, 4.5)));
    // Heights became normals: flat at the extremes, leaning left where the height grows to the right.
    let normals = &scene.textures[material.normal_texture.unwrap().texture as usize].rgba;
    assert_eq!(normals[0][0], normals[4][0]);
    assert!(normals[2][0] < normals[0][0] && normals[6][0] > normals[0][0], "{normals:?}");
    assert!(only(&scene).tangents.iter().all(|t| t.abs_diff_eq(Vec4::new(1.0, 0.0, 0.0, 1.0), 1e-5)));
    assert!(scene.notes.iter().any(|note| note.text.contains("gone.png")));
}

#[test]
fn errors_name_file_and_line() {
    for (text, expected) in [
        ("v 0 0\n", "a.obj: line 1: 2 numbers, 3 are needed"),
        ("v 0 0 0\nf 1 1 2\n", "a.obj: line 2: index 2, but there are 1 vertices so far"),
        ("v 0 0 0\nf 1/1 1 1\n", "a.obj: line 2: index 1, but there are 0 texture coordinates so far"),
        ("v 0 0 0\nf 1/1/1/1 1 1\n", "a.obj: line 2: "),
        ("v 0 0 0 0\n", "a.obj: line 1: the weight 0"),
        ("v 0 0 1e39\n", "a.obj: line 1: inf is not finite"),
        ("hello\n", "a.obj: has no vertices"),
    ] {
        let error = read(text, &[]).unwrap_err().to_string();
        assert!(error.contains(expected), "{text:?}: {error}");
    }
    let text = format!("mtllib m.mtl\n{SQUARE}usemtl a\nf 1 2 3\n");
    let error = read(&text, &[("m.mtl", b"newmtl a\nKd red\n")]).unwrap_err().to_string();
    assert!(error.contains("m.mtl: line 2: \"red\" is no number"), "{error}");
    let error =
        read(&text, &[("m.mtl", b"newmtl a\nmap_Kd b.png\n"), ("b.png", b"no picture")]).unwrap_err().to_string();
    assert!(error.contains("b.png: material \"a\""), "{error}");
}

#[test]
fn large_files_of_nothing_are_refused_unread() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.obj", "a.gltf", "a.glb", "a.bin"] {
        let path = folder.path().join(name);
        // A hole of eight TiB.
        std::fs::File::create(&path).unwrap().set_len(8 << 40).ok();
        let error = load(&path, &LoadOptions::default()).unwrap_err().to_string();
        assert!(error.contains("is neither text nor a GLB container") || error.contains("is no scene file"), "{error}");
    }
}

#[test]
fn a_cut_jpeg_is_told_of() {
    let mut jpeg = vec![];
    let grey: Vec<u8> = (0..64 * 64).map(|i| (i * 37 % 251) as u8).collect();
    image::codecs::jpeg::JpegEncoder::new(&mut jpeg).encode(&grey, 64, 64, image::ExtendedColorType::L8).unwrap();
    let text = format!("mtllib a.mtl\n{SQUARE}usemtl m\nf 1/1 2/2 3/3 4/4\n");
    let notes = |bytes: &[u8]| {
        let scene = read(&text, &[("a.mtl", b"newmtl m\nmap_Kd a.jpg\n"), ("a.jpg", bytes)]).unwrap();
        assert_eq!(scene.textures.len(), 1);
        let of_textures = |note: &lucerna::scene::Note| note.place.starts_with("texture");
        scene.notes.into_iter().filter(of_textures).map(|note| (note.kind, note.place, note.text)).collect::<Vec<_>>()
    };
    let cut = "the JPEG ends before its picture does; the rest is grey";
    assert_eq!(notes(&jpeg), []);
    let told = [(NoteKind::Approximated, r#"texture "a.jpg""#.to_owned(), cut.to_owned())];
    assert_eq!(notes(&jpeg[..2 * jpeg.len() / 3]), told);
}

/// A tetrahedron around (x, 0.3, 0.3) with its fronts outwards, or inwards; its corners are the next four.
fn tetrahedron(text: &mut String, x: f32, size: f32, inwards: bool) {
    for [a, b, c] in [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] {
        let at = |v: f32| 0.3 + size * (v - 0.25);
        text.push_str(&format!("v {} {} {}\n", x - 0.3 + at(a), at(b), at(c)));
    }
    for [a, b, c] in [[-4, -2, -3], [-4, -3, -1], [-4, -1, -2], [-3, -2, -1]] {
        let [b, c] = if inwards { [c, b] } else { [b, c] };
        text.push_str(&format!("f {a} {b} {c}\n"));
    }
}

const GLASS: (&str, &[u8]) =
    ("a.mtl", b"newmtl glass\nillum 7\nNi 1.5\nKd 0 0 0\nKs 1 1 1\nTf 1 1 1\nnewmtl paint\nKd 0.5 0.5 0.5\n");

/// Twelve times the volume that the primitive's triangles turn outwards, and its double-sidedness.
fn outwards(scene: &Scene, primitive: &Primitive) -> (f32, bool) {
    let corner = |i: usize| primitive.positions[primitive.indices[i] as usize];
    let six = (0..primitive.indices.len()).step_by(3).map(|i| corner(i).dot(corner(i + 1).cross(corner(i + 2)))).sum();
    for triangle in primitive.indices.chunks_exact(3) {
        let [a, b, c] = [0, 1, 2].map(|k| primitive.positions[triangle[k] as usize]);
        let facing = (b - a).cross(c - a).dot(primitive.normals[triangle[0] as usize]);
        assert!(facing > 0.0, "normals on the other side than the triangles");
    }
    (six, scene.materials[primitive.material as usize].double_sided)
}

#[test]
fn closed_glass_is_a_body_and_open_glass_a_sheet() {
    // A body, one that is wound inside out, and one with a cavity.
    for (inwards, cavity) in [(false, false), (true, false), (false, true)] {
        let mut text = "mtllib a.mtl\nusemtl glass\n".to_owned();
        tetrahedron(&mut text, 0.3, 1.0, inwards);
        if cavity {
            tetrahedron(&mut text, 0.3, 0.5, true);
        }
        let scene = read(&text, &[GLASS]).unwrap();
        let (six, double_sided) = outwards(&scene, only(&scene));
        assert!(!double_sided && (six - if cavity { 0.875 } else { 1.0 }).abs() < 1e-5, "{inwards} {cavity}: {six}");
    }
    // A body that lacks a side is a sheet, and said to be.
    let mut text = "mtllib a.mtl\nusemtl glass\n".to_owned();
    tetrahedron(&mut text, 0.3, 1.0, false);
    let open = read(text.rsplit_once("f -3").unwrap().0, &[GLASS]).unwrap();
    assert!(open.materials[only(&open).material as usize].double_sided);
    assert!(open.notes.iter().any(|note| note.text.contains("thin panes")), "{:?}", open.notes);
    // As is one with two sides at the same place.
    let flat = format!("mtllib a.mtl\nusemtl glass\n{SQUARE}f 1 2 3 4\nf 4 3 2 1\n");
    let flat = read(&flat, &[GLASS]).unwrap();
    assert!(flat.materials[only(&flat).material as usize].double_sided);
    // Both of one material become two, with all triangles kept; other surfaces keep both sides.
    let mut text = format!("mtllib a.mtl\n{SQUARE}usemtl paint\nf 1 2 3 4\nusemtl glass\nf 1 2 3 4\n");
    tetrahedron(&mut text, 4.0, 1.0, false);
    let mixed = read(&text, &[GLASS]).unwrap();
    let sides: Vec<(usize, bool)> = mixed.meshes[0]
        .primitives
        .iter()
        .map(|p| (p.indices.len() / 3, mixed.materials[p.material as usize].double_sided))
        .collect();
    assert_eq!(sides, [(2, true), (2, true), (4, false)]);
}
