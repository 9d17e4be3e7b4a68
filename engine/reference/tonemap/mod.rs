//! Slow and obvious CPU versions of every tone mapping operator, written from the papers and from the documentation of
//! [`Settings`], never from the shaders. All arithmetic is in 64 bits.

pub mod ashikhmin;
pub mod bilateral;
pub mod curves;
pub mod drago;
pub mod fattal;
pub mod identify;
pub mod mantiuk;
pub mod plane;
pub mod pyramid;
pub mod receptor;
pub mod reinhard;
pub mod solve;
pub mod statistics;

#[cfg(test)]
mod solved_tests;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod usual;

use crate::techniques::tonemap::{BadValues, Local, Mode, Operator, Settings};
use plane::Plane;
use statistics::Statistics;

/// Tone maps linear Rec. 709 pixels, `width · height` of them, top row first. The result is linear and relative to the display's
/// white. Of what [`Settings`] say about speed, [`Local::Pyramid`] is
/// followed, for it has a definition of its own; the rest, and what they say about time, means nothing here.
pub fn tonemap(width: u32, height: u32, pixels: &[[f32; 3]], settings: &Settings) -> Vec<[f32; 3]> {
    tonemap_masked(width, height, pixels, None, settings)
}

/// [`tonemap`] with a mask of pixels that are important whatever is in the picture.
pub fn tonemap_masked(
    width: u32,
    height: u32,
    pixels: &[[f32; 3]],
    mask: Option<&[bool]>,
    settings: &Settings,
) -> Vec<[f32; 3]> {
    let picture = Picture::new(width, height, pixels, settings);
    match settings.operator {
        Operator::Ashikhmin | Operator::Reinhard | Operator::Bilateral | Operator::ReinhardGlobal | Operator::Drago => {
            picture.scaled(&picture.display(mask))
        }
        Operator::Linear => picture.pixels.clone(),
        Operator::Aces => picture.each(curves::aces),
        Operator::Agx => picture.each(curves::agx),
        Operator::Neutral => picture.each(curves::neutral),
        Operator::ReinhardDevlin => picture.received(),
        Operator::Fattal | Operator::Mantiuk => picture.scaled(&picture.solved()),
    }
}

/// Luminance with the statistics that operators ask for, after the exposure.
#[derive(Clone, Debug)]
pub struct Picture<'a> {
    settings: &'a Settings,
    /// Cleaned of what is no colour, exposed, at most 10¹⁸.
    pub pixels: Vec<[f32; 3]>,
    /// 0 below 10⁻³⁰, 10¹⁸ above that.
    pub luminance: Plane,
    /// L_min and L_max by the percentile.
    pub statistics: Statistics,
}

impl<'a> Picture<'a> {
    /// Cleans, exposes, and looks at the whole.
    pub fn new(width: u32, height: u32, pixels: &[[f32; 3]], settings: &'a Settings) -> Self {
        let (width, height) = (width as usize, height as usize);
        let cleaned = clean(width, height, pixels, settings.bad_values);
        let limited = |l: f64| if l < 1e-30 { 0.0 } else { l.min(1e18) };
        let mut factor = f64::from(settings.exposure).exp2();
        if settings.normalize {
            let before = plane::luminance(width, height, &cleaned).map(limited);
            factor /= statistics::log_average(&before.values, statistics::DELTA);
        }
        let pixels: Vec<[f32; 3]> =
            cleaned.iter().map(|p| p.map(|v| (f64::from(v) * factor).min(1e18) as f32)).collect();
        let luminance = plane::luminance(width, height, &pixels).map(limited);
        let statistics = statistics::statistics(&luminance.values, f64::from(settings.percentile));
        Self { settings, pixels, luminance, statistics }
    }

    fn each(&self, curve: impl Fn([f64; 3]) -> [f64; 3]) -> Vec<[f32; 3]> {
        self.pixels.iter().map(|p| curve(p.map(f64::from)).map(|v| v as f32)).collect()
    }

    /// Reinhard and Devlin.
    fn received(&self) -> Vec<[f32; 3]> {
        let (settings, Statistics { min, max, log_average }) = (self.settings, self.statistics);
        let mean = |c: usize| self.pixels.iter().map(|p| f64::from(p[c])).sum::<f64>() / self.pixels.len() as f64;
        let receptor = receptor::Receptor {
            mean: [0, 1, 2].map(mean),
            intensity: settings.intensity.into(),
            contrast: settings.receptor_contrast.map_or_else(|| receptor::contrast(min, max, log_average), f64::from),
            chromatic: settings.chromatic.into(),
            adaptation: settings.adaptation.into(),
        };
        receptor::stretched(&self.pixels.iter().map(|p| receptor.response(*p)).collect::<Vec<_>>())
    }

    /// log₁₀ L, L being at least 10⁻⁶ L_max, for the operators that solve an equation.
    pub fn logarithm(&self) -> Plane {
        let least = (bilateral::DARKEST * self.statistics.max).max(1e-30);
        self.luminance.map(|l| l.max(least).log10())
    }

    /// Display luminance of every pixel by Fattal and Mantiuk.
    fn solved(&self) -> Plane {
        let (settings, logarithm) = (self.settings, self.logarithm());
        if logarithm.values.is_empty() {
            return logarithm;
        }
        let codes = settings.operator == Operator::Mantiuk;
        let solution = if codes {
            mantiuk::solution(&logarithm, settings.contrast_scale.into())
        } else {
            fattal::solution(&logarithm, settings.alpha.into(), settings.beta.into())
        };
        let ends = statistics::statistics(&solution.values, settings.clipped().into());
        let median = statistics::statistics(&solution.values, 50.0).min;
        if codes {
            solution.map(|x| mantiuk::shown(x, [ends.min, median, ends.max]))
        } else {
            solution.map(|x| fattal::shown(x, [ends.min, ends.max]))
        }
    }

    /// Local adaptation of every pixel as the operator and the mode want it, in the operator's own unit: L, the scaled l of Reinhard,
    /// or log₁₀ L of the base.
    pub fn adaptation(&self, mask: Option<&[bool]>) -> Plane {
        let own = self.own();
        let mode = self.settings.mode();
        if mode == Mode::Global {
            return own;
        }
        let average = match self.settings.local {
            Local::Pyramid => pyramid::averages,
            Local::Fast | Local::Literal | Local::Growing => {
                |plane: &Plane, _: f64, weights: &[f64]| plane.averages(weights)
            }
        };
        let local = match self.settings.operator {
            Operator::Ashikhmin => ashikhmin::Search::of(self.settings).adaptation(&own, average),
            Operator::Reinhard => reinhard::Scales::of(self.settings).adaptation(&own, average),
            Operator::Bilateral => {
                let (sigma, radius) = self.settings.bilateral(own.width as u32, own.height as u32);
                bilateral::filter(&own, f64::from(sigma), radius.min(80) as usize, f64::from(self.settings.range))
            }
            _ => return own,
        };
        if mode == Mode::Local {
            return local;
        }
        let important = self.important(mask);
        Plane::from_fn(
            own.width,
            own.height,
            |x, y| {
                if important[y * own.width + x] { local[(x, y)] } else { own[(x, y)] }
            },
        )
    }

    /// Which pixels get local adaptation in the selective mode: identified, or in the mask.
    pub fn important(&self, mask: Option<&[bool]>) -> Vec<bool> {
        let mut important = identify::important(&self.luminance, self.statistics.log_average, self.settings);
        for (important, masked) in important.iter_mut().zip(mask.unwrap_or_default()) {
            *important |= masked;
        }
        important
    }

    /// Luminance in the operator's own unit.
    fn own(&self) -> Plane {
        let Statistics { max, log_average, .. } = self.statistics;
        let key = f64::from(self.settings.key);
        match self.settings.operator {
            Operator::Reinhard => self.luminance.map(|l| key * l / log_average),
            Operator::Bilateral => self.luminance.map(|l| l.max(bilateral::DARKEST * max).log10()),
            _ => self.luminance.clone(),
        }
    }

    /// Display luminance of every pixel, of operators that scale colour by it.
    pub fn display(&self, mask: Option<&[bool]>) -> Plane {
        let settings = self.settings;
        let Statistics { min, max, .. } = self.statistics;
        let own = self.own();
        let level = self.limited(&own, self.adaptation(mask));
        let white = if settings.white > 0.0 { f64::from(settings.white) } else { self.white(max) };
        let both = |f: &(dyn Fn(f64, f64) -> f64 + Sync)| {
            Plane::from_fn(own.width, own.height, |x, y| f(own[(x, y)], level[(x, y)]).max(0.0))
        };
        match settings.operator {
            Operator::Ashikhmin => {
                let (display, capacity) = (f64::from(settings.display), ashikhmin::capacity);
                let curve = ashikhmin::Curve { low: min, high: max, display, capacity };
                both(&|l, level| curve.display(l, level) / curve.display)
            }
            Operator::Reinhard if settings.mode() == Mode::Global => both(&|l, _| reinhard::global(l, white)),
            Operator::Reinhard => both(&reinhard::local),
            Operator::ReinhardGlobal => both(&|l, _| reinhard::global(l, white)),
            Operator::Drago => {
                let bias = f64::from(settings.bias);
                both(&|l, _| drago::display(l, max, self.statistics.log_average, bias))
            }
            Operator::Bilateral => {
                let base = bilateral::Base::new(min, max, f64::from(settings.base_contrast));
                let detail = f64::from(settings.detail);
                both(&|own, level| 10f64.powf(base.map(level) + detail * (own - level)))
            }
            _ => own.clone(),
        }
    }

    /// Local adaptation within the contrast limit. Both in the operator's own unit.
    fn limited(&self, own: &Plane, level: Plane) -> Plane {
        let Some(limit) = self.settings.contrast_limit().map(f64::from) else { return level };
        Plane::from_fn(own.width, own.height, |x, y| {
            let (own, level) = (own[(x, y)], level[(x, y)]);
            if self.settings.operator == Operator::Bilateral {
                level.clamp(own - limit.log10(), own + limit.log10())
            } else {
                level.clamp(own / limit, own * limit)
            }
        })
    }

    /// The white that stands for 0: the largest luminance in the operator's unit.
    fn white(&self, max: f64) -> f64 {
        match self.settings.operator {
            Operator::Reinhard => f64::from(self.settings.key) * max / self.statistics.log_average,
            _ => max,
        }
    }

    /// Colour scaled by L_d / L, its ratios to luminance raised to the saturation. What has no luminance is black.
    fn scaled(&self, display: &Plane) -> Vec<[f32; 3]> {
        let saturation = f64::from(self.settings.saturation());
        let pixel = |(i, p): (usize, &[f32; 3])| {
            let l = self.luminance.values[i];
            if l == 0.0 {
                [0.0; 3]
            } else {
                p.map(|v| (display.values[i] * (f64::from(v) / l).powf(saturation)) as f32)
            }
        };
        self.pixels.iter().enumerate().map(pixel).collect()
    }
}

/// What [`BadValues`] says becomes of NaN, infinite and negative values; where they are an error, they are zeros here.
pub fn clean(width: usize, height: usize, pixels: &[[f32; 3]], policy: BadValues) -> Vec<[f32; 3]> {
    let largest: [f32; 3] =
        std::array::from_fn(|c| pixels.iter().map(|p| p[c]).filter(|v| v.is_finite()).fold(0.0, f32::max));
    let good = |p: [f32; 3]| p.iter().all(|v| v.is_finite());
    let at = |i: usize| {
        let p = pixels[i];
        let (x, y) = ((i % width) as isize, (i / width) as isize);
        match policy {
            _ if good(p) => p,
            BadValues::Zero | BadValues::Error => p.map(|v| if v.is_finite() { v } else { 0.0 }),
            BadValues::Clamp => std::array::from_fn(|c| match p[c] {
                v if v.is_nan() => 0.0,
                f32::INFINITY => largest[c],
                v => v,
            }),
            BadValues::Neighbour => {
                let places = (-1..=1).flat_map(|j| (-1..=1).map(move |i| (x + i, y + j)));
                let inside =
                    places.filter(|(x, y)| (0..width as isize).contains(x) && (0..height as isize).contains(y));
                let near: Vec<[f32; 3]> =
                    inside.map(|(x, y)| pixels[y as usize * width + x as usize]).filter(|p| good(*p)).collect();
                let mean = |c: usize| near.iter().map(|p| f64::from(p[c])).sum::<f64>() / near.len().max(1) as f64;
                std::array::from_fn(|c| mean(c) as f32)
            }
        }
        .map(|v| v.max(0.0))
    };
    (0..pixels.len()).map(at).collect()
}
