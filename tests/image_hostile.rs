//! Damaged and hostile images: an error, in seconds, in bounded memory.

mod common;

use std::{
    alloc::{GlobalAlloc, Layout, System},
    path::{Path, PathBuf},
    sync::{
        Mutex,
        atomic::{AtomicUsize, Ordering::Relaxed},
    },
    time::{Duration, Instant},
};

use lucerna::{
    Result,
    image::{self, Format, Layer, Layers, Metadata, WriteOptions},
    scene::{Limits, environment, texture},
};

struct Counting;

static NOW: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);
/// One measurement at a time.
static ALONE: Mutex<()> = Mutex::new(());

// SAFETY: only counts what the system's allocator does.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        PEAK.fetch_max(NOW.fetch_add(layout.size(), Relaxed) + layout.size(), Relaxed);
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        NOW.fetch_sub(layout.size(), Relaxed);
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Peak bytes and time of a call.
fn measured<T>(call: impl FnOnce() -> T) -> (T, usize, Duration) {
    let before = NOW.load(Relaxed);
    PEAK.store(before, Relaxed);
    let start = Instant::now();
    let result = call();
    (result, PEAK.load(Relaxed).saturating_sub(before), start.elapsed())
}

fn files(folder: &Path, into: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() { files(&path, into) } else { into.push(path) }
    }
}

#[test]
fn all_damaged_images_give_errors_that_name_them() {
    let Some(assets) = common::assets() else { return };
    let _alone = ALONE.lock();
    let mut list = Vec::new();
    for folder in ["openexr", "pillow", "image-rs"] {
        files(&assets.join("malformed").join(folder), &mut list);
    }
    assert!(list.len() > 150, "{}", list.len());
    let (mut refused, mut largest) = (0, 0);
    for path in list {
        let (result, peak, time) = measured(|| image::read(&path, &Limits::default()));
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        assert!(peak < 256 << 20, "{name}: {peak} bytes");
        assert!(time < Duration::from_secs(5), "{name}: {time:?}");
        largest = largest.max(peak);
        if let Err(error) = result {
            assert_eq!(error.exit_code(), 3, "{error}");
            assert!(error.file() == Some(&path) && !error.to_string().contains('\n'), "{error}");
            refused += 1;
        }
        // The same files as textures of a scene.
        let bytes = std::fs::read(&path).unwrap();
        let (result, peak, time) = measured(|| texture::decode(&bytes, None, &Limits::default()));
        assert!(peak < 256 << 20 && time < Duration::from_secs(5), "{name}: {peak} bytes, {time:?}");
        if let Ok(texture) = result {
            assert_eq!(texture.rgba.len(), texture.width as usize * texture.height as usize);
        }
    }
    eprintln!("{refused} refused, largest peak {} KiB", largest >> 10);
    // A few are only unusual.
    assert!(refused > 150, "{refused}");
}

fn le(values: &[u32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

/// An EXR file that is nothing but a header of that data window.
fn exr_header(width: u32, height: u32) -> Vec<u8> {
    let mut file = le(&[20_000_630, 2]);
    let mut attribute = |name: &str, kind: &str, value: &[u8]| {
        file.extend(
            [name.as_bytes(), b"\0", kind.as_bytes(), b"\0", &(value.len() as u32).to_le_bytes(), value].concat(),
        );
    };
    let window = le(&[0, 0, width.wrapping_sub(1), height.wrapping_sub(1)]);
    attribute("channels", "chlist", &[&b"R\0"[..], &le(&[1, 0, 1, 1]), b"\0"].concat());
    attribute("compression", "compression", &[3]);
    attribute("dataWindow", "box2i", &window);
    attribute("displayWindow", "box2i", &window);
    attribute("lineOrder", "lineOrder", &[0]);
    attribute("pixelAspectRatio", "float", &1f32.to_le_bytes());
    attribute("screenWindowCenter", "v2f", &[0; 8]);
    attribute("screenWindowWidth", "float", &1f32.to_le_bytes());
    file.push(0);
    file
}

fn hdr_header(height: &str, width: &str) -> Vec<u8> {
    format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n").into_bytes()
}

/// A PNG file that is nothing but a header of that size.
fn png_header(width: u32, height: u32) -> Vec<u8> {
    let chunk = [&b"IHDR"[..], &width.to_be_bytes(), &height.to_be_bytes(), &[8, 0, 0, 0, 0]].concat();
    let sum = !chunk.iter().fold(!0u32, |sum, &byte| {
        (0..8).fold(sum ^ u32::from(byte), |c, _| if c & 1 == 1 { (c >> 1) ^ 0xedb8_8320 } else { c >> 1 })
    });
    [b"\x89PNG\r\n\x1a\n", &13u32.to_be_bytes()[..], &chunk, &sum.to_be_bytes(), &[0, 0, 0, 9], b"IDAT"].concat()
}

/// Headers that ask for what is not there: little memory, little time, an error that says so.
#[test]
fn promises_without_pixels_cost_nothing() {
    let _alone = ALONE.lock();
    let mut long_line = b"#?RADIANCE\n".to_vec();
    long_line.resize(64 << 20, b'x');
    let cases: Vec<(&str, Vec<u8>, &str)> = vec![
        ("exr 60000²", exr_header(60_000, 60_000), "60000×60000 pixels"),
        ("exr 10000²", exr_header(10_000, 10_000), "cannot come from"),
        ("exr 2^31 wide", exr_header(1 << 31, 1), ""),
        ("exr negative", exr_header(0, 5), ""),
        ("hdr 60000²", hdr_header("60000", "60000"), "60000×60000 pixels"),
        ("hdr 8000²", hdr_header("8000", "8000"), "damaged in line 0"),
        ("hdr empty", hdr_header("10", "0"), "image of 0×10 pixels"),
        ("hdr 2^33", hdr_header("8589934592", "1"), "is no size"),
        ("hdr 64 MiB line", long_line, "header"),
        ("hdr short", hdr_header("8", "8"), "line 0 of 8"),
        ("png 60000²", png_header(60_000, 60_000), "60000×60000 pixels"),
        ("pfm 60000²", b"PF\n60000 60000\n-1\n".to_vec(), "60000×60000 pixels"),
        ("pfm short", b"PF\n100 100\n-1\n".to_vec(), "0 bytes of pixels where 100×100 need 120000"),
        ("pfm scale", b"PF\n1 1\n0\n\0\0\0\0\0\0\0\0\0\0\0\0".to_vec(), "scale"),
        ("pfm minus", b"PF\n-1 1\n-1\n".to_vec(), "is no size"),
        ("nothing", vec![], "no image format"),
        ("exr magic", vec![0x76, 0x2f, 0x31, 0x01], "header"),
        ("png magic", vec![0x89, b'P', b'N', b'G', 13, 10, 26, 10], "PNG"),
    ];
    for (name, bytes, expected) in cases {
        let (result, peak, time) = measured(|| image::decode(&bytes, &Limits::default()));
        let error = result.expect_err(name).to_string();
        assert!(error.contains(expected), "{name}: {error}");
        assert!(peak < 8 << 20, "{name}: {peak} bytes");
        assert!(time < Duration::from_secs(1), "{name}: {time:?}");
        assert!(environment::decode(&bytes, name, &Limits::default()).is_err());
    }
}

/// A small picture in each format with each kind of content.
fn seeds() -> Vec<Vec<u8>> {
    let wave = |n: usize| (0..n).map(|i| (i as f32 * 0.37).sin().abs() * 3.0).collect::<Vec<_>>();
    let metadata = Metadata { scene: "s".into(), ..Metadata::default() };
    let picture = Layers { metadata, ..Layers::rgba(24, 17, wave(24 * 17 * 4)) };
    let layered = picture.clone().with(Layer::new("depth", &["Z"], wave(24 * 17)));
    let mut seeds = Vec::new();
    for format in [Format::Exr, Format::Hdr, Format::Png, Format::Pfm, Format::Jpeg] {
        seeds.push(image::encode(format, &layered, &WriteOptions::default()).unwrap().0);
    }
    let wide = WriteOptions { png_bits: 16, f32: true, ..WriteOptions::default() };
    seeds.push(image::encode(Format::Png, &picture, &wide).unwrap().0);
    seeds.push(image::encode(Format::Exr, &picture, &wide).unwrap().0);
    seeds
}

/// Bytes changed at random, the same in every run. `LUCERNA_FUZZ_ROUNDS` makes it longer.
#[test]
fn random_damage_never_panics() {
    let _alone = ALONE.lock();
    let rounds: usize = std::env::var("LUCERNA_FUZZ_ROUNDS").ok().and_then(|n| n.parse().ok()).unwrap_or(300);
    let limits = Limits { max_alloc: 1 << 24, max_image_pixels: 1 << 20, ..Limits::default() };
    let mut inputs = seeds();
    if let Some(assets) = common::assets() {
        // Other compressions and tiles, small enough to be decoded often.
        for name in ["hdr/formats/old-rle.hdr", "hdr/formats/overexposed_gradient.exr", "hdr/testimages/stripes.exr"] {
            inputs.push(std::fs::read(assets.join(name)).unwrap());
        }
    }
    let mut state = 3u64;
    let mut random = move |below: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below
    };
    let (mut read, mut refused) = (0, 0);
    for original in inputs {
        for _ in 0..rounds {
            let mut bytes = original.clone();
            // Half of the damage goes into the first part, where the header is.
            for _ in 0..1 + random(3) {
                let span = if random(2) == 0 { bytes.len() } else { bytes.len().min(300) };
                let at = random(span);
                bytes[at] = [random(256) as u8, 0, 0xff, 0x7f][random(4)];
            }
            if random(6) == 0 {
                bytes.truncate(random(bytes.len()));
            }
            let (result, peak, time): (Result<Layers>, _, _) = measured(|| image::decode(&bytes, &limits));
            assert!(peak < 128 << 20 && time < Duration::from_secs(5), "{peak} bytes, {time:?}");
            match result {
                Ok(picture) => {
                    picture.layers.iter().for_each(|layer| {
                        assert_eq!(layer.data.len(), (picture.width * picture.height) as usize * layer.channels.len());
                    });
                    read += 1;
                }
                Err(error) => {
                    // The last resort was not needed: our own checks and the decoders' caught it.
                    assert!(!error.to_string().contains("gave up"), "{error}");
                    refused += 1;
                }
            }
        }
    }
    assert!(read > 0 && refused > 0);
}
