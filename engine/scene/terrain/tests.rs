use std::collections::HashMap;

use super::*;

fn map(size: UVec2, value: impl Fn(f32, f32) -> f32) -> HeightMap {
    let at = |i: u32| value((i % size.x) as f32 / (size.x - 1) as f32, (i / size.x) as f32 / (size.y - 1) as f32);
    HeightMap { size, values: (0..size.x * size.y).map(at).collect(), metres: false }
}

fn hills(x: f32, y: f32) -> f32 {
    0.5 + 0.3 * (7.0 * x).sin() * (5.0 * y + 1.0).cos() + 0.2 * (-40.0 * ((x - 0.7).powi(2) + (y - 0.3).powi(2))).exp()
}

fn mesh(map: &HeightMap, terrain: &Terrain) -> Primitive {
    let mut scene = Scene::default();
    add(&mut scene, map, terrain, &Limits::default()).unwrap();
    scene.validate().unwrap();
    assert_eq!((scene.nodes[0].name.as_str(), scene.materials[0].name.as_str()), (NAME, NAME));
    scene.meshes.remove(0).primitives.remove(0)
}

/// Corners of each triangle.
fn triangles(mesh: &Primitive) -> Vec<[Vec3; 3]> {
    mesh.indices.chunks_exact(3).map(|c| [0, 1, 2].map(|k| mesh.positions[c[k] as usize])).collect()
}

#[test]
fn the_surface_is_within_its_error_of_every_sample_and_has_no_cracks() {
    let map = map(uvec2(65, 65), hills);
    let mut before = usize::MAX;
    for error in [0.02, 0.1, 0.5, 2.0] {
        let terrain = Terrain { width: 64.0, height: 20.0, error, middle: Vec3::new(5.0, 1.0, -3.0) };
        let mesh = mesh(&map, &terrain);
        let all = triangles(&mesh);
        // Fewer triangles for a larger error, and all of the map is covered once.
        assert!(all.len() < before, "{error}: {}", all.len());
        before = all.len();
        let area: f32 = all.iter().map(|[a, b, c]| 0.5 * (*b - *a).cross(*c - *a).y).sum();
        assert!((area - 64.0 * 64.0).abs() < 0.1, "{area}");
        assert!(all.iter().all(|[a, b, c]| (*b - *a).cross(*c - *a).y > 0.0), "all triangles face upwards");
        // Each side is that of one more triangle, in the other direction, or lies on the rim.
        let mut sides = HashMap::new();
        for c in mesh.indices.chunks_exact(3) {
            for k in 0..3 {
                *sides.entry((c[k], c[(k + 1) % 3])).or_insert(0) += 1;
            }
        }
        for (&(a, b), &count) in &sides {
            let [p, q] = [a, b].map(|i| mesh.positions[i as usize] - terrain.middle);
            let rim = [p.x, p.z].iter().zip([q.x, q.z]).any(|(p, q)| p.abs() == 32.0 && *p == q);
            assert!(count == 1 && (rim || sides.contains_key(&(b, a))), "{p} {q}");
        }
        let worst = (0..65 * 65)
            .map(|i| {
                let at = terrain.middle + Vec3::new((i % 65) as f32 - 32.0, 0.0, (i / 65) as f32 - 32.0);
                (height_at(&all, at) - (terrain.middle.y + 20.0 * map.values[i])).abs()
            })
            .fold(0.0, f32::max);
        assert!(worst <= 1.001 * error, "{error}: {worst}");
        assert!(worst > 0.1 * error, "the bound is near the error: {error}: {worst}");
    }
}

/// Height of the surface over a place.
fn height_at(all: &[[Vec3; 3]], at: Vec3) -> f32 {
    let inside = |[a, b, c]: &[Vec3; 3]| {
        let side = |p: Vec3, q: Vec3| (q - p).cross(at - p).y;
        let [u, v, w] = [side(*b, *c), side(*c, *a), side(*a, *b)];
        let all = u + v + w;
        (u.min(v).min(w) >= -1e-3).then(|| (u * a.y + v * b.y + w * c.y) / all)
    };
    all.iter().find_map(inside).unwrap()
}

#[test]
fn a_plane_takes_two_triangles_and_a_step_takes_many() {
    let plane = map(uvec2(33, 17), |x, y| 0.25 * x + 0.5 * y);
    let terrain = Terrain { width: 32.0, height: 8.0, error: 1e-4, middle: Vec3::ZERO };
    let flat = mesh(&plane, &terrain);
    // Half of the square grid is left out: one triangle as wide as the map, and two beside it.
    assert_eq!(flat.indices.len(), 9);
    // The longer edge has the width; the top of the picture lies at −Z.
    let span = |of: fn(&Vec3) -> f32| flat.positions.iter().map(of).fold(f32::MIN, f32::max);
    assert_eq!([span(|p| p.x), span(|p| p.z), span(|p| p.y)], [16.0, 8.0, 6.0]);
    let near = flat.positions.iter().find(|p| p.x < 0.0 && p.z > 0.0).unwrap();
    assert!((near.y - 4.0).abs() < 1e-5);
    let normal = Vec3::new(-2.0 / 32.0, 1.0, -4.0 / 16.0).normalize();
    assert!(flat.normals.iter().all(|n| (*n - normal).length() < 1e-4), "{:?}", flat.normals);
    let step = map(uvec2(33, 33), |x, _| if x > 0.4 { 1.0 } else { 0.0 });
    let many = mesh(&step, &terrain).indices.len() / 3;
    assert!((64..1200).contains(&many), "{many}");
}

#[test]
fn maps_of_any_size_are_within_the_error_of_every_sample() {
    for (size, error) in
        [(uvec2(50, 23), 0.3), (uvec2(17, 40), 0.1), (uvec2(64, 64), 0.5), (uvec2(2, 9), 0.01), (uvec2(3, 2), 0.0)]
    {
        // A single high sample counts, too.
        let mut odd = map(size, hills);
        let peak = (size.x / 2 + size.x * (size.y / 2)) as usize;
        odd.values[peak] = 1.0;
        let width = (size.max_element() - 1) as f32;
        let terrain = Terrain { width, height: 10.0, error, middle: Vec3::ZERO };
        let mesh = mesh(&odd, &terrain);
        let all = triangles(&mesh);
        let area: f32 = all.iter().map(|[a, b, c]| 0.5 * (*b - *a).cross(*c - *a).y).sum();
        let edges = (size - 1).as_vec2();
        assert!((area - edges.x * edges.y).abs() < 1e-2, "{size}: {area}");
        for i in 0..size.x * size.y {
            let at = (uvec2(i % size.x, i / size.x).as_vec2() - 0.5 * edges).extend(0.0);
            let off = (height_at(&all, Vec3::new(at.x, 0.0, at.y)) - 10.0 * odd.values[i as usize]).abs();
            assert!(off <= 1.001 * error + 1e-4, "{size}, sample {i}: {off}");
        }
        assert!(mesh.uvs[0].iter().all(|uv| uv.cmpge(Vec2::ZERO).all() && uv.cmple(Vec2::ONE).all()));
    }
}

#[test]
fn large_maps_are_averaged_and_that_is_said() {
    let size = uvec2(12_289, 3);
    let values = (0..size.x * size.y).map(|i| if (i % size.x).is_multiple_of(3) { 1.0 } else { 0.0 }).collect();
    let map = HeightMap { size, values, metres: false };
    let mut scene = Scene::default();
    add(&mut scene, &map, &Terrain::of(&map, None, Some(3.0), Some(0.5)), &Limits::default()).unwrap();
    assert!(scene.notes[0].text.contains("averaged to 4097 × 2"), "{}", scene.notes[0].text);
    let heights = scene.meshes[0].primitives[0].positions.iter().map(|place| place.y);
    assert!(heights.clone().fold(0.0, f32::max) < 2.1 && heights.fold(9.0, f32::min) > 0.5);
}

#[test]
fn usual_numbers_follow_the_map() {
    let whole = map(uvec2(101, 51), |x, _| 0.2 + 0.5 * x);
    let usual = Terrain::of(&whole, None, None, None);
    assert_eq!((usual.width, usual.height), (100.0, 10.0));
    assert!((usual.error - 5e-3).abs() < 1e-6);
    let wide = Terrain::of(&whole, Some(990.0), None, None);
    assert!((wide.height - 99.0).abs() < 1e-3 && (wide.error - 0.0495).abs() < 1e-5, "{wide:?}");
    // Metres stay metres.
    let metres = HeightMap { values: whole.values.iter().map(|value| 400.0 * value).collect(), metres: true, ..whole };
    let usual = Terrain::of(&metres, Some(3000.0), None, None);
    assert_eq!(usual.height, 1.0);
    assert!((usual.error - 0.2).abs() < 1e-4);
    for width in [4, 7, 12] {
        let small = map(uvec2(width, 2), hills);
        Terrain::of(&small, Some(1e6), None, None).check().unwrap();
    }
}

#[test]
fn numbers_out_of_range_are_refused_and_named() {
    let map = map(uvec2(3, 3), hills);
    let usual = Terrain::of(&map, None, None, None);
    for (terrain, name) in [
        (Terrain { width: 0.0, ..usual }, "the width"),
        (Terrain { height: f32::NAN, ..usual }, "the height"),
        (Terrain { error: -1.0, ..usual }, "the error"),
        (Terrain { middle: Vec3::INFINITY, ..usual }, "the middle"),
    ] {
        let error = add(&mut Scene::default(), &map, &terrain, &Limits::default()).unwrap_err();
        assert!(error.exit_code() == 2 && error.to_string().contains(name), "{error}");
    }
    let far = HeightMap { values: vec![1e20; 9], metres: true, ..map.clone() };
    for height in [1.0, 1e5] {
        let error = add(&mut Scene::default(), &far, &Terrain { height, ..usual }, &Limits::default()).unwrap_err();
        assert!(error.exit_code() == 2 && error.to_string().contains("too far"), "{error}");
    }
    for (size, count) in [(uvec2(0, 0), 0), (uvec2(1, 9), 9), (uvec2(3, 3), 8)] {
        let odd = HeightMap { size, values: vec![0.5; count], metres: false };
        Terrain::of(&odd, None, None, None);
        let error = add(&mut Scene::default(), &odd, &usual, &Limits::default()).unwrap_err();
        assert!(error.exit_code() == 3 && error.to_string().contains("samples"), "{error}");
    }
    let few = Limits { max_vertices: 9, ..Limits::default() };
    let error = add(&mut Scene::default(), &map, &Terrain { error: 0.0, ..usual }, &few).unwrap_err();
    assert!(error.to_string().contains("Allow a larger error"), "{error}");
}

fn png(width: u32, height: u32, color: png::ColorType, depth: png::BitDepth, bytes: &[u8]) -> Vec<u8> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width, height);
    encoder.set_color(color);
    encoder.set_depth(depth);
    encoder.write_header().unwrap().write_image_data(bytes).unwrap();
    file
}

#[test]
fn pictures_are_read_with_all_their_bits() {
    let read = |bytes: &[u8]| HeightMap::decode(bytes, &Limits::default());
    let deep: Vec<u8> = [0u16, 1, 257, 65535].iter().flat_map(|code| code.to_be_bytes()).collect();
    let (found, notes) = read(&png(2, 2, png::ColorType::Grayscale, png::BitDepth::Sixteen, &deep)).unwrap();
    assert!(notes.is_empty());
    assert_eq!(found.values, [0.0, 1.0 / 65535.0, 257.0 / 65535.0, 1.0]);
    let (found, _) = read(&png(2, 2, png::ColorType::Grayscale, png::BitDepth::Eight, &[0, 1, 128, 255])).unwrap();
    assert_eq!(found.values, [0.0, 1.0 / 255.0, 128.0 / 255.0, 1.0]);
    let (_, notes) = read(&png(2, 2, png::ColorType::Rgb, png::BitDepth::Eight, &[9; 12])).unwrap();
    assert!(notes[0].text.contains("luma"), "{}", notes[0].text);
    // A photograph that ends too early is read, and named.
    let (mut jpeg, grey) = (Vec::new(), (0..64 * 64).map(|i| (i % 64 * 4) as u8).collect::<Vec<_>>());
    let mut encoder = ::image::codecs::jpeg::JpegEncoder::new(&mut jpeg);
    encoder.encode(&grey, 64, 64, ::image::ExtendedColorType::L8).unwrap();
    assert!(read(&jpeg).unwrap().1.is_empty());
    let (found, notes) = read(&jpeg[..jpeg.len() * 3 / 4]).unwrap();
    assert_eq!((found.values.len(), notes.len(), notes[0].kind), (64 * 64, 1, NoteKind::Approximated));
    assert!(notes[0].text.contains("the JPEG ends before"), "{}", notes[0].text);
    // Floating-point numbers are as they are.
    let mut pfm = b"Pf\n2 2\n-1.0\n".to_vec();
    pfm.extend([3.0f32, -4.0, 1.0, 2.0].iter().flat_map(|value| value.to_le_bytes()));
    assert_eq!(read(&pfm).unwrap().0.values, [1.0, 2.0, 3.0, -4.0]);
    let last = pfm.len() - 4;
    pfm[last..].copy_from_slice(&f32::NAN.to_le_bytes());
    assert!(read(&pfm).unwrap_err().to_string().contains("row 0 is no finite number"));
    let error = read(&png(1, 4, png::ColorType::Grayscale, png::BitDepth::Eight, &[0; 4])).unwrap_err();
    assert!(error.to_string().contains("at least two rows"), "{error}");
    assert_eq!(read(b"not a picture").unwrap_err().exit_code(), 3);
    assert!(
        HeightMap::read(Path::new("no/such.png"), &Limits::default()).unwrap_err().to_string().contains("no/such.png")
    );
}
