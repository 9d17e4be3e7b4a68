//! From light to the codes of a screen, in the way of `render`.

use lucerna::{
    Result,
    gpu::Gpu,
    image::{self, Layer, Layers, WriteOptions},
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

/// What the values of a picture are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Values {
    /// Light, which has an exposure and a curve.
    Radiance,
    /// Light as a screen shows it, exposure and curve included.
    Screen,
    /// No light: normals, numbers of lights, …
    Numbers,
}

impl Values {
    /// Those of a rendered picture. `is_light`: it is radiance before the tone mapping of the settings.
    pub fn of(wanted: &Wanted, is_light: bool) -> Self {
        match (is_light, wanted.is_developed()) {
            (false, _) => Self::Numbers,
            (true, true) => Self::Screen,
            (true, false) => Self::Radiance,
        }
    }
}

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

    /// The codes of a picture, row by row from the upper left corner. `ev`: exposure of radiance.
    ///
    /// # Errors
    /// As [`Screen::shown`].
    pub fn codes(&mut self, wanted: &Wanted, layers: &Layers, values: Values, ev: f64) -> Result<Vec<[u8; 3]>> {
        let plain = WriteOptions::default();
        if let Shows::Layer(name) = &wanted.shows
            && let Some(layer) = layers.layer(name)
        {
            return image::screen(layer, &plain);
        }
        let Some(main) = layers.main() else { return Ok(Vec::new()) };
        match wanted.look {
            _ if values == Values::Numbers => image::screen(main, &plain),
            Look::FalseColour => Ok(false_colours(main, if values == Values::Radiance { ev } else { 0.0 })),
            Look::Light(_) if values == Values::Screen => image::screen(main, &plain),
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
    pixels.into_iter().map(|pixel| magma(share(pixel))).collect()
}

/// The scale of false colours: luminance, with the exposure, at the dark and at the bright end.
pub fn false_colour_range() -> [f32; 2] {
    [8.0 * 10f32.powf(-DECADES), 8.0]
}

/// 2 |A − B| of the codes of both sides, at most 255.
pub fn difference(a: &[[u8; 3]], b: &[[u8; 3]]) -> Vec<[u8; 3]> {
    let twice = |(a, b): (&[u8; 3], &[u8; 3])| std::array::from_fn(|i| a[i].abs_diff(b[i]).saturating_mul(2));
    a.iter().zip(b).map(twice).collect()
}

/// A map of a measure as codes of magma. The range has the values of the darkest and of the brightest colour.
pub fn of_map(values: &[f32], [low, high]: [f32; 2]) -> Vec<[u8; 3]> {
    let span = if high > low { high - low } else { 1.0 };
    values.iter().map(|value| magma((value - low) / span)).collect()
}
