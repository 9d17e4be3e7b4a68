use std::path::{Path, PathBuf};

use super::*;

/// A file of the shared assets; `None`, said aloud, where a user's checkout has none.
fn asset(name: &str) -> Option<Vec<u8>> {
    let path: PathBuf =
        Path::new(&std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_else(|| env!("CARGO_MANIFEST_DIR").into()))
            .join("../shared/assets")
            .join(name);
    match std::fs::read(&path) {
        Ok(bytes) => Some(bytes),
        Err(error) if std::env::var_os("CI").is_some() => panic!("{}: {error}", path.display()),
        Err(_) => {
            eprintln!("SKIPPED: no {}", path.display());
            None
        }
    }
}

fn read(name: &str) -> Option<Texture> {
    asset(name).map(|bytes| decode(&bytes, None, &Limits::default()).unwrap_or_else(|e| panic!("{name}: {e}")))
}

/// The pictures show the name of their format in white on a plain ground; the last row is ground only.
#[test]
fn every_encoding_shows_its_name_on_its_ground() {
    let grounds: [(&str, [u8; 3], u8); 8] = [
        ("2d_rgba8", [77, 175, 74], 0),
        ("2d_rgb8", [77, 175, 74], 0),
        ("2d_uastc", [186, 151, 0], 1),
        ("2d_etc1s", [186, 151, 0], 6),
        ("2d_bc1", [255, 128, 0], 3),
        ("2d_bc7", [255, 127, 0], 0),
        ("2d_rgba16_linear", [20, 110, 18], 1),
        ("2d_rgba32_linear", [20, 110, 18], 1),
    ];
    for (name, ground, tolerance) in grounds {
        let Some(texture) = read(&format!("gltf/ktx2/{name}.ktx2")) else { return };
        assert_eq!((texture.width, texture.height, texture.rgba.len()), (40, 40, 1600), "{name}");
        let white = texture.rgba.iter().filter(|t| t[..3].iter().all(|&v| v > 240)).count();
        assert!((30..300).contains(&white), "{name}: {white} white texels");
        for texel in &texture.rgba[39 * 40..] {
            let near = texel.iter().zip(ground).all(|(&a, b)| a.abs_diff(b) <= tolerance);
            assert!(near, "{name}: {texel:?} where {ground:?} is expected");
        }
    }
}

#[test]
fn zstandard_levels_are_unpacked_and_sizes_checked() {
    let name = "gltf/AnisotropyBarnLamp/AnisotropyBarnLamp_normalbump.ktx2";
    let Some(texture) = read(name) else { return };
    assert_eq!((texture.width, texture.height), (1024, 1024));
    // A normal map: unit vectors on average, mostly straight up.
    let up = texture.rgba.iter().filter(|t| t[2] > 200 && t[0].abs_diff(128) < 40).count();
    assert!(up > texture.rgba.len() * 9 / 10, "{up}");

    let Some(mut bytes) = asset(name) else { return };
    let small = Limits { max_image_pixels: 1000, ..Limits::default() };
    assert!(decode(&bytes, None, &small).unwrap_err().to_string().contains("1024×1024 pixels, at most 1000"));
    // A larger width needs more bytes than the level unpacks to.
    bytes[20..24].copy_from_slice(&1028u32.to_le_bytes());
    let error = decode(&bytes, None, &Limits::default()).unwrap_err().to_string();
    assert!(error.contains("level 0: 3145728 bytes of texels where 3158016 are needed"), "{error}");
}

#[test]
fn what_is_no_image_is_named() {
    let error = decode(b"GIF89a", Some("image/gif"), &Limits::default()).unwrap_err().to_string();
    assert_eq!(
        error,
        "6 bytes that start with [47 49 46 38], said to be image/gif. Textures are PNG, JPEG, WebP, BMP, TGA, DDS or KTX2."
    );
    assert!(decode(b"", None, &Limits::default()).is_err());
}

/// A PNG of one colour.
fn png(width: u32, height: u32) -> Vec<u8> {
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, width, height);
    encoder.set_color(png::ColorType::Grayscale);
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(&vec![77; (width * height) as usize]).unwrap();
    writer.finish().unwrap();
    out
}

#[test]
fn large_headers_are_refused_before_anything_is_allocated() {
    let mut bytes = png(8, 8);
    let texture = decode(&bytes, Some("image/png"), &Limits::default()).unwrap();
    assert_eq!(texture.rgba, [[77, 77, 77, 255]; 64]);
    for (at, value) in [(16, 60_000u32), (20, 60_000)] {
        bytes[at..at + 4].copy_from_slice(&value.to_be_bytes());
    }
    let checksum = crc32(&bytes[12..29]);
    bytes[29..33].copy_from_slice(&checksum.to_be_bytes());
    let error = decode(&bytes, None, &Limits::default()).unwrap_err().to_string();
    assert!(error.contains("60000") || error.contains("limits"), "{error}");
}

fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0u32, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |c, _| if c & 1 == 1 { c >> 1 ^ 0xedb8_8320 } else { c >> 1 })
    })
}

#[test]
fn device_bytes_are_a_third_more_with_mips() {
    assert_eq!(device_bytes(4, 4, false), 64);
    assert_eq!(device_bytes(4, 4, true), 64 + 16 + 4);
    assert_eq!(device_bytes(4, 1, true), 16 + 8 + 4);
}

/// Damaged files of every kind give an error or an image of the stated size, never a panic of the caller or an abort.
#[test]
fn damaged_files_do_not_end_the_process() {
    let names = ["2d_rgba8", "2d_uastc", "2d_etc1s", "2d_bc1", "2d_bc7"].map(|name| format!("gltf/ktx2/{name}.ktx2"));
    let limits = Limits { max_image_pixels: 1 << 16, max_alloc: 1 << 22, ..Limits::default() };
    let mut state = 1u64;
    let mut random = move |below: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below
    };
    for name in names {
        let Some(original) = asset(&name) else { continue };
        let rounds = std::env::var("LUCERNA_FUZZ_ROUNDS").ok().and_then(|n| n.parse().ok()).unwrap_or(400);
        for _ in 0..rounds {
            let mut bytes = original.clone();
            for _ in 0..1 + random(4) {
                let at = random(bytes.len());
                bytes[at] = random(256) as u8;
            }
            if random(8) == 0 {
                bytes.truncate(random(bytes.len()));
            }
            if let Ok(texture) = decode(&bytes, None, &limits) {
                assert_eq!(texture.rgba.len(), texture.width as usize * texture.height as usize);
            }
        }
    }
}
