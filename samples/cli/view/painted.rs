//! From light to the codes of a screen, in the way of `render`.

use lucerna::{
    Result,
    gpu::Gpu,
    image::{self, Layer, Layers, WriteOptions, srgb},
    measure::magma,
    techniques::tonemap::Operator,
};

use super::{
    live::STEP,
    wanted::{Look, Shows, Wanted},
};
use crate::screen::Screen;

/// Decades of false colours.
const DECADES: f32 = 5.0;

/// Develops pictures on a device.
#[derive(Debug)]
pub(super) struct Painter {
    gpu: Gpu,
    screen: Option<(Operator, Screen)>,
}

impl Painter {
    pub fn new(gpu: &Gpu) -> Self {
        Self { gpu: gpu.clone(), screen: None }
    }

    /// The codes of a picture. `is_light`: exposure and curve are for it. `ev`: exposure.
    ///
    /// # Errors
    /// As [`Screen::shown`].
    pub fn codes(&mut self, wanted: &Wanted, layers: &Layers, is_light: bool, ev: f64) -> Result<Vec<[u8; 3]>> {
        let plain = WriteOptions::default();
        if let Shows::Layer(name) = &wanted.shows
            && let Some(layer) = layers.layer(name)
        {
            return image::screen(layer, &plain);
        }
        let Some(main) = layers.main() else { return Ok(Vec::new()) };
        if !is_light {
            return image::screen(main, &plain);
        }
        // Tone mapping by the settings has the exposure already, and takes the place of the curve.
        let developed = wanted.settings.get("tonemap").is_some_and(|tonemap| !tonemap.is_null());
        match wanted.look {
            Look::FalseColour => Ok(false_colours(main, ev)),
            Look::Light(_) if developed => image::screen(main, &plain),
            Look::Light(None) => image::screen(main, &WriteOptions { exposure_ev: ev as f32, ..plain }),
            Look::Light(Some(curve)) => {
                if self.screen.as_ref().is_none_or(|(by, _)| *by != curve) {
                    self.screen = Some((curve, Screen::new(&self.gpu, Some(curve))));
                }
                let shown = match &mut self.screen {
                    Some((_, screen)) => screen.shown(layers, ev, Some(STEP))?,
                    None => None,
                };
                match shown.as_ref().and_then(Layers::main) {
                    Some(shown) => image::screen(shown, &plain),
                    None => image::screen(main, &plain),
                }
            }
        }
    }
}

/// Luminance as colours of magma, over five decades up to eight times white.
fn false_colours(layer: &Layer, ev: f64) -> Vec<[u8; 3]> {
    let scale = (ev as f32).exp2();
    let pixels = layer.rgb_pixels().unwrap_or_default();
    let share = |[r, g, b]: [f32; 3]| {
        let luminance = (0.2126 * r + 0.7152 * g + 0.0722 * b) * scale;
        ((luminance / 8.0).max(1e-30).log10() + DECADES) / DECADES
    };
    pixels.into_iter().map(|pixel| magma(share(pixel).clamp(0.0, 1.0))).collect()
}

/// The scale of false colours: luminance, with the exposure, at the dark and at the bright end.
pub fn false_colour_range() -> [f32; 2] {
    [8.0 * 10f32.powf(-DECADES), 8.0]
}

/// Codes of |A − B| of what both sides show, twice as bright as they are.
pub fn difference(a: &[[u8; 3]], b: &[[u8; 3]]) -> Vec<[u8; 3]> {
    let twice = |(a, b): (&[u8; 3], &[u8; 3])| std::array::from_fn(|i| a[i].abs_diff(b[i]).saturating_mul(2));
    a.iter().zip(b).map(twice).collect()
}

/// A map of a measure, as codes.
pub fn of_map(values: &[f32], [low, high]: [f32; 2]) -> Vec<[u8; 3]> {
    let span = if high > low { high - low } else { 1.0 };
    values.iter().map(|value| magma((value - low) / span)).collect()
}

/// Codes of a file's picture, as it is shown beside a rendered one.
pub fn of_file(layers: &Layers, ev: f64) -> Vec<[u8; 3]> {
    let scale = (ev as f32).exp2();
    let pixels = layers.main().and_then(Layer::rgb_pixels).unwrap_or_default();
    pixels.into_iter().map(|pixel| pixel.map(|value| srgb::encode_u8(value * scale))).collect()
}
