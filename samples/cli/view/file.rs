//! A picture of a file on a side of the window.

use std::{path::Path, sync::Arc, time::Instant};

use lucerna::{Result, image, scene::Limits};

use super::{
    painted::{Painter, Values},
    session::Shared,
    wanted::{FilePicture, Shown, Wanted},
};
use crate::{args::Size, exposure};

/// Reads a picture.
///
/// # Errors
/// `Input`, naming the file.
pub fn read(path: &Path) -> Result<FilePicture> {
    let limits = Limits::default();
    let bytes = image::read_file_checked(path, limits.max_file)?;
    let layers = image::decode(&bytes, &limits).map_err(|error| error.in_file(path))?;
    Ok(FilePicture {
        path: path.to_owned(),
        layers: Arc::new(layers),
        is_for_screens: image::is_display_referred(&bytes),
    })
}

/// Shows the picture for each request. Returns the first request for something else; `None` if the window closes.
///
/// # Errors
/// As [`Painter::codes`].
pub(super) fn work(shared: &Shared, painter: &mut Painter, first: Wanted) -> Result<Option<Wanted>> {
    let mut wanted = first.clone();
    loop {
        if let Some(FilePicture { layers, is_for_screens, .. }) = &wanted.file {
            let begun = Instant::now();
            let values = if *is_for_screens { Values::Screen } else { Values::Radiance };
            let ev = wanted.exposure.unwrap_or_else(|| if *is_for_screens { 0.0 } else { exposure::fitting(layers) });
            let pixels = painter.codes(&wanted, layers, values, ev)?;
            shared.show(Shown {
                number: 0,
                size: Size { width: layers.width, height: layers.height },
                pixels,
                layers: layers.clone(),
                exposure: ev,
                fresh: true,
                whole: true,
                of: wanted.clone(),
                milliseconds: begun.elapsed().as_secs_f64() * 1e3,
                passes: Arc::default(),
                images: Arc::default(),
                notes: layers.warnings.clone(),
                samples: 0.0,
                noise: None,
                at: Instant::now(),
            });
        }
        wanted = match shared.next() {
            Some(next) if next.same_scene(&first) => next,
            other => return Ok(other),
        };
    }
}
