//! The C++ encoder of the format's author (crate `meshopt`) is the reference.

use super::*;
use proptest::prelude::*;

fn triangle_list(faces: &[(u8, u8, u8)]) -> Vec<u32> {
    faces.iter().flat_map(|&(a, b, c)| [u32::from(a), u32::from(b), u32::from(c)]).collect()
}

/// The codec may rotate the corners of a triangle.
fn same_triangles(a: &[u32], b: &[u32]) -> bool {
    a.len() == b.len()
        && a.chunks(3).zip(b.chunks(3)).all(|(a, b)| (0..3).any(|r| (0..3).all(|i| a[i] == b[(i + r) % 3])))
}

fn u32s(bytes: &[u8]) -> Vec<u32> {
    bytes.chunks(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

    #[test]
    fn vertices_survive(rows in prop::collection::vec(prop::array::uniform12(0u8..40), 1..700)) {
        let mut encoded = meshopt::encode_vertex_buffer(&rows).unwrap();
        // The crate writes version 1 streams by default; version 0 is what the extension allows.
        if encoded[0] != 0xa0 {
            encoded = meshopt_version_0(&rows);
        }
        let decoded = decode(&encoded, Mode::Attributes, Filter::None, rows.len(), 12).unwrap();
        prop_assert_eq!(decoded, rows.concat());
    }

    #[test]
    fn triangles_survive(faces in prop::collection::vec((0u8..90, 0u8..90, 0u8..90), 0..300)) {
        let indices = triangle_list(&faces);
        let encoded = meshopt::encode_index_buffer(&indices, 256).unwrap();
        let decoded = decode(&encoded, Mode::Triangles, Filter::None, indices.len(), 4).unwrap();
        prop_assert!(same_triangles(&u32s(&decoded), &indices));
    }

    #[test]
    fn strips_of_neighbours_survive(columns in 2u32..30, rows in 2u32..30) {
        let mut indices = Vec::new();
        for y in 0..rows - 1 {
            for x in 0..columns - 1 {
                let i = y * columns + x;
                indices.extend_from_slice(&[i, i + 1, i + columns, i + columns, i + 1, i + columns + 1]);
            }
        }
        let encoded = meshopt::encode_index_buffer(&indices, (columns * rows) as usize).unwrap();
        let decoded = decode(&encoded, Mode::Triangles, Filter::None, indices.len(), 4).unwrap();
        prop_assert!(same_triangles(&u32s(&decoded), &indices));
    }

    #[test]
    fn sequences_survive(indices in prop::collection::vec(0u32..1000, 1..300)) {
        let encoded = meshopt::encode_index_sequence(&indices, 1000).unwrap();
        let decoded = decode(&encoded, Mode::Indices, Filter::None, indices.len(), 4).unwrap();
        prop_assert_eq!(u32s(&decoded), indices);
    }

    #[test]
    fn hostile_streams_end_in_an_error_or_data(
        first in prop::sample::select(vec![0xa0u8, 0xe0, 0xe1, 0xd0, 0xd1]),
        rest in prop::collection::vec(any::<u8>(), 0..400),
        count in 0usize..600,
        stride in 0usize..300,
    ) {
        let data = [vec![first], rest].concat();
        for mode in [Mode::Attributes, Mode::Triangles, Mode::Indices] {
            for filter in [Filter::None, Filter::Octahedral, Filter::Quaternion, Filter::Exponential] {
                if let Ok(out) = decode(&data, mode, filter, count, stride) {
                    prop_assert_eq!(out.len(), count * stride);
                }
            }
        }
    }
}

fn meshopt_version_0(rows: &[[u8; 12]]) -> Vec<u8> {
    meshopt::encode_vertex_buffer_level(rows, 2, Some(0)).unwrap()
}

#[test]
fn octahedral_vectors_come_back_to_unit_length() {
    let directions: Vec<[f32; 4]> = [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.48, -0.6, -0.64]]
        .iter()
        .map(|v| [v[0], v[1], v[2], 0.0])
        .collect();
    let encoded: Vec<[i16; 4]> = meshopt::encode_filter_oct(&directions, 12);
    let mut bytes: Vec<u8> = encoded.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
    apply(Filter::Octahedral, &mut bytes, 8, Mode::Attributes).unwrap();
    for (element, want) in bytes.chunks(8).zip(&directions) {
        let got = shorts(element).map(|v| f32::from(v) / 32767.0);
        for i in 0..3 {
            assert!((got[i] - want[i]).abs() < 2e-3, "{got:?} instead of {want:?}");
        }
    }
}

#[test]
fn quaternions_come_back() {
    let rotations = [[0.5f32, 0.5, 0.5, 0.5], [0.0, 0.0, 0.0, 1.0], [0.6, 0.0, 0.8, 0.0], [-0.1, 0.7, 0.1, 0.7]];
    let encoded = meshopt::encode_filter_quat(&rotations, 12);
    let mut bytes: Vec<u8> = encoded.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
    apply(Filter::Quaternion, &mut bytes, 8, Mode::Attributes).unwrap();
    for (element, want) in bytes.chunks(8).zip(&rotations) {
        let got = shorts(element).map(|v| f32::from(v) / 32767.0);
        let length: f32 = want.iter().map(|v| v * v).sum::<f32>().sqrt();
        let dot: f32 = got.iter().zip(want).map(|(a, b)| a * b / length).sum();
        assert!(dot.abs() > 0.9999, "{got:?} instead of {want:?}");
    }
}

#[test]
fn exponential_floats_are_exact() {
    for (bits, want) in [(0x0000_0003i32, 3.0f32), (0xff00_0003u32 as i32, 1.5), (0x02ff_ffffu32 as i32, -4.0)] {
        let mut bytes = bits.to_le_bytes();
        exponential(&mut bytes);
        assert_eq!(f32::from_le_bytes(bytes), want);
    }
}
