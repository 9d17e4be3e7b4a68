//! Limits on the work that a picture's metadata may cause without `--long`.

use lucerna::{Error, Result};

use crate::record::Record;

/// Maximum of frames, from the first frame of the run to the recorded frame.
const FRAMES: u64 = 1000;
/// Maximum of pictures whose means these frames are.
const PICTURES: u64 = 8 * FRAMES;
/// Maximum of paths of a reference picture: some minutes on a GPU.
const PATHS: u64 = 10_000_000_000;
/// Maximum of rays for each object before the first frame, such as for the vectors of an occluder: some minutes on a GPU.
const RAYS: u64 = 100_000_000_000;
/// Maximum of rendered pixels, if the file's size does not tell their number.
const PIXELS: u64 = 1 << 24;
/// Maximum of added lights, of added objects, and of further objects on a ground.
const THINGS: u64 = 256;

/// Returns an error if the picture needs more than `allowed` of something.
fn over(place: &str, asked: u64, allowed: u64, what: &str) -> Result<()> {
    if asked <= allowed {
        return Ok(());
    }
    Err(Error::input(format!("needs {asked} {what}; without --long at most {allowed} are allowed"))
        .at(place)
        .help("Give --long if you trust the source of the picture and have enough time"))
}

/// Checks that a record does not need more than its picture justifies, and, without `long`, no work that takes hours. `extent`: size of the
/// file's picture.
///
/// # Errors
/// `Input`, with the number that is too large.
pub fn check(record: &Record, extent: [u32; 2], long: bool) -> Result<()> {
    // Two eyes of `prt` are side by side.
    let views = 1 + u32::from(record.settings["prt"]["eyes"].as_f64().is_some_and(|apart| apart > 0.0));
    let [width, height] = [record.width.saturating_mul(views), record.height];
    // An image of the graph may have any size.
    if record.view.is_none() && [width, height] != extent {
        let [w, h] = extent;
        return Err(
            Error::input(format!("the metadata state {width}×{height} pixels, but the file has {w}×{h}")).at("width")
        );
    }
    if long {
        return Ok(());
    }
    let frames = u64::from(record.frame).saturating_sub(record.first_frame.into()) + 1;
    over("frame", frames, FRAMES, "frames")?;
    over("aa.count", frames.saturating_mul(record.aa.count.into()), PICTURES, "pictures")?;
    let pixels = u64::from(width) * u64::from(height);
    if record.view.is_some() {
        over("width", pixels, PIXELS, "pixels")?;
    }
    let samples = record.settings["samples"].as_u64().unwrap_or(1);
    over("settings.samples", samples.saturating_mul(pixels), PATHS, "paths")?;
    over("light", record.light.len() as u64, THINGS, "lights")?;
    over("add", record.add.len() as u64, THINGS, "objects")?;
    over("set", record.set.len() as u64, THINGS, "materials")?;
    let beside = record.ground.as_ref().map_or(0, |ground| ground.beside.len());
    over("ground.beside", beside as u64, THINGS, "objects")
}

/// The same check for the rays of each object that a technique must trace before the first frame.
///
/// # Errors
/// `Input`, with the number.
pub fn rays(technique: &str, rays: u64, long: bool) -> Result<()> {
    if long { Ok(()) } else { over(&format!("settings.{technique}"), rays, RAYS, "rays for each object") }
}

#[cfg(test)]
mod tests {
    use lucerna::{
        technique::Technique,
        techniques::fiv::{self, Fiv},
    };
    use serde_json::json;

    use super::*;

    fn record(changes: serde_json::Value) -> Record {
        let mut config = json!({
            "command": ["isr", "render"], "scene": {"builtin": "cornell"}, "fingerprint": "0", "width": 8, "height": 4,
            "camera": {"scene": 0}, "first_frame": 0, "frame": 0, "time": 0.0, "fps": 30.0, "exposure": 0.0, "seed": 0,
            "settings": {},
        });
        changes.as_object().unwrap().iter().for_each(|(key, value)| config[key] = value.clone());
        Record::from_config(&config).unwrap()
    }

    #[test]
    fn what_would_take_hours_is_refused_unless_asked_for() {
        let lights = vec!["0,1,0,1"; 300];
        for (changes, number, place) in [
            (json!({ "frame": 4_000_000_000u32 }), "4000000001", "frame"),
            (json!({ "first_frame": 5, "frame": 1005 }), "1001", "frame"),
            (json!({ "frame": 999, "aa": { "count": 16, "filter": "box" } }), "16000", "aa.count"),
            (json!({ "settings": { "samples": 400_000_000 } }), "12800000000", "settings.samples"),
            (json!({ "settings": { "samples": u64::MAX } }), "18446744073709551615", "settings.samples"),
            (json!({ "view": "x", "width": 16384, "height": 16384 }), "268435456", "width"),
            (json!({ "light": lights }), "300", "light"),
            (json!({ "ground": { "beside": vec!["a.obj"; 300] } }), "300", "ground.beside"),
        ] {
            let record = record(changes);
            let error = check(&record, [8, 4], false).unwrap_err();
            assert_eq!((error.exit_code(), error.place()), (3, Some(place)));
            assert!(error.to_string().contains(number) && error.to_string().contains("--long"), "{error}");
            check(&record, [8, 4], true).unwrap();
        }
        check(&record(json!({ "settings": { "prt": { "eyes": 0.06 } } })), [16, 4], false).unwrap();
        check(&record(json!({ "settings": { "prt": { "eyes": 0.0 } } })), [16, 4], false).unwrap_err();
        check(&record(json!({ "frame": 999, "settings": { "samples": 4096 } })), [8, 4], false).unwrap();
    }

    #[test]
    fn sizes_are_those_of_the_file() {
        let error = check(&record(json!({ "width": 16384, "height": 16384 })), [8, 4], true).unwrap_err();
        assert!(error.to_string().contains("16384×16384") && error.to_string().contains("8×4"), "{error}");
    }

    #[test]
    fn vectors_are_counted() {
        let counted = |fiv: fiv::Settings, long| {
            rays("fiv", Fiv::rays(&fiv::PictureSettings { fiv, ..Default::default() }), long)
        };
        counted(fiv::Settings::default(), false).unwrap();
        let many = fiv::Settings { azimuths: 1024, polars: 513, radii: 128, ..fiv::Settings::default() };
        assert!(counted(many.clone(), false).is_err() && counted(many.clone(), true).is_ok());
        let most = fiv::Settings { azimuths: u32::MAX, size: u32::MAX, split: u32::MAX, ..many };
        assert!(counted(most, false).unwrap_err().to_string().contains(&u64::MAX.to_string()));
    }
}
