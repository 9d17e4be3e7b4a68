//! Files for screens: .png and .jpg files of pictures that are light get a curve like that of film, so that bright places keep their shape.
//!
//! Files of other formats keep the light, and so do files of single layers (`{layer}` in their name), which are compared and added.

use clap::{
    Args,
    builder::{PossibleValuesParser, TypedValueParser},
};
use lucerna::{
    Error, Result,
    gpu::Gpu,
    image::{Layer, Layers},
    techniques::tonemap::{self, Operator, Still},
};

/// The curves of `--operator`. Operators that need more of a picture than its exposure are settings (`-D tonemap.operator`).
pub const CURVES: [Operator; 5] =
    [Operator::Linear, Operator::ReinhardGlobal, Operator::Aces, Operator::Agx, Operator::Neutral];

/// The curve without `--operator`.
///
/// By the look of six built-in scenes (office, conference, garage, street, hall, parlour): `agx` without a look of its own is flat and pale, `neutral`
/// takes 0.04 off every channel, which makes dim colours gaudy, and `reinhard-global` makes a picture dark if a window or a lamp is in it.
pub const USUAL: Operator = Operator::Aces;

/// Exposure of the ACES fit beside that of the picture, stops: 1 / 0.6, as three.js has it ("ACESFilmicToneMapping"), so that middle grey stays about as
/// bright as without a curve.
const ACES_STOPS: f32 = 0.737;

/// Options for files for screens.
#[derive(Args, Clone, Copy, Debug, Default)]
pub struct ScreenArgs {
    /// Curve of .png and .jpg files for light beyond white: a film-like one (aces), another one, or none (linear). Other formats keep the light;
    /// -D tonemap.operator=... tone maps all files [default: aces; linear with --paper]
    #[arg(long, value_name = "CURVE", value_parser = parser(), help_heading = "Picture")]
    pub operator: Option<Operator>,
}

fn parser() -> impl TypedValueParser<Value = Operator> {
    PossibleValuesParser::new(CURVES.map(Operator::name)).try_map(|name| named(&name).ok_or("is no curve"))
}

/// The curve of this name.
pub fn named(name: &str) -> Option<Operator> {
    CURVES.into_iter().find(|curve| curve.name() == name)
}

impl ScreenArgs {
    /// The curve of the command line. `None`: none. `radiance`: the picture is light. `developed`: settings tone map it.
    ///
    /// # Errors
    /// `Usage` for a curve that such a picture cannot have.
    pub fn curve(self, paper: bool, radiance: bool, developed: bool) -> Result<Option<Operator>> {
        let curve = self.operator.unwrap_or(if paper { Operator::Linear } else { USUAL });
        if curve == Operator::Linear {
            return Ok(None);
        }
        let wrong = match (radiance, developed) {
            (true, false) => return Ok(Some(curve)),
            (false, _) => "the values of this picture are no light, so they have no curve",
            (true, true) => {
                "the settings of tonemap map the picture already; use -D tonemap.operator for another operator"
            }
        };
        if self.operator.is_some() { Err(Error::usage(wrong).at("--operator")) } else { Ok(None) }
    }
}

/// Applies the curve to the pictures of a run.
#[derive(Debug)]
pub struct Screen {
    gpu: Gpu,
    curve: Option<Operator>,
    still: Option<Still>,
}

impl Screen {
    /// `None`: files show the light as it is.
    pub fn new(gpu: &Gpu, curve: Option<Operator>) -> Self {
        Self { gpu: gpu.clone(), curve, still: None }
    }

    /// The picture for screens, with one layer; `None` without a curve. `ev`: exposure of the picture. `dt`: seconds since the frame before, in sequences.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`; `Usage` if the stops are too many.
    pub fn shown(&mut self, layers: &Layers, ev: f64, dt: Option<f32>) -> Result<Option<Layers>> {
        let Some(curve) = self.curve else { return Ok(None) };
        let Some(main) = layers.main() else { return Ok(None) };
        let Some([r, g, b]) = main.colours() else { return Ok(None) };
        let alpha = main.channel("A").filter(|_| main.channels.len() > 1);
        let light = |p: &[f32]| [p[r], p[g], p[b], alpha.map_or(1.0, |a| p[a])];
        let pixels = main.data.chunks_exact(main.channels.len()).map(light).collect();
        let settings = settings(curve, ev);
        let still = match &mut self.still {
            Some(still) => still,
            none => none.insert(Still::new(&self.gpu, &settings)?),
        };
        still.tonemap().set(&settings)?;
        let mapped = still.map(layers.width, layers.height, pixels, None, dt)?.pixels;
        let layer = if alpha.is_some() { Layer::rgba("", &mapped) } else { Layer::rgb("", &mapped) };
        Ok(Some(Layers { metadata: layers.metadata.clone(), ..Layers::new(layers.width, layers.height).with(layer) }))
    }
}

fn settings(curve: Operator, ev: f64) -> tonemap::Settings {
    let stops = if curve == Operator::Aces { ACES_STOPS } else { 0.0 };
    tonemap::Settings {
        operator: curve,
        exposure: (stops + ev as f32).clamp(-40.0, 40.0),
        ..tonemap::Settings::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_by_name_and_by_default() {
        let asked = |name: Option<&str>| ScreenArgs { operator: name.map(|name| named(name).unwrap()) };
        let curve = |name, paper, radiance, developed| asked(name).curve(paper, radiance, developed).ok();
        assert_eq!(curve(None, false, true, false), Some(Some(Operator::Aces)));
        assert_eq!(curve(None, true, true, false), Some(None));
        assert_eq!(curve(Some("linear"), false, true, false), Some(None));
        assert_eq!(curve(Some("agx"), true, true, false), Some(Some(Operator::Agx)));
        for (radiance, developed) in [(false, false), (true, true)] {
            assert_eq!(curve(None, false, radiance, developed), Some(None));
            assert_eq!(curve(Some("linear"), false, radiance, developed), Some(None));
            assert_eq!(curve(Some("aces"), false, radiance, developed), None);
        }
        assert_eq!(named("ashikhmin"), None);
        assert!(CURVES.iter().all(|curve| settings(*curve, 1e9).validate().is_ok()));
    }
}
