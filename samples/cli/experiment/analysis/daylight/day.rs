//! The frames of a day, as the kind `daylight-frames` stores them.

use lucerna::{
    Error, Result,
    measure::{Display, Exposure, Measure, Measured, Options, Pair, Picture},
    techniques::daylight::Day as Civil,
};

use crate::{
    daylight::DayOptions,
    experiment::{
        kinds,
        results::{Done, Layer, Results},
    },
};

/// PerceptualDiff calls two pictures different from 100 pixels on. The paper's pictures have 800×600.
const SEEN: f64 = 100.0 / (800.0 * 600.0);
/// Number of the paper's frame, of [`PAPER_LIT`] lit frames; the first is 1.
const PAPER_FRAME: f64 = 121.0;
const PAPER_LIT: f64 = 180.0;
/// Lit frames at least: both ends of the day and one between.
const LEAST: usize = 3;
/// Frames that are darker than this share of the brightest one have no relative error.
const DARK: f64 = 1e-3;

/// The indirect light of the sun at all lit times of a day.
pub(super) struct Day {
    /// Scene and view.
    pub name: String,
    /// The same for identifiers.
    pub id: String,
    pub width: usize,
    pub height: usize,
    /// Steps of the whole day.
    pub steps: usize,
    /// Seconds of the day of each lit time.
    pub seconds: Vec<f64>,
    /// Irradiance of the sun at each lit time.
    sun: Vec<[f32; 3]>,
    albedo: Vec<[f32; 3]>,
    /// Irradiance for a white sun of 1 W/m², one picture after the other.
    white: Vec<[f32; 3]>,
    civil: Civil,
    /// Measures with one exposure for the whole day.
    pub options: Options,
    /// Whether a frame counts where errors are relative to its mean.
    bright: Vec<bool>,
}

impl Day {
    /// # Errors
    /// `Input` if the run is missing or is no run of `daylight-frames`.
    pub fn read(results: &Results, run: &Done) -> Result<Self> {
        let wrong = |what: &str| Error::input(what).at(format!("{}/{} {}", run.scene, run.view, run.label()));
        let times = results.times(run)?;
        let fact = |name: &str| times.fact(name).ok_or_else(|| wrong(&format!("has no number '{name}'")));
        let (steps, lit) = (fact("steps")? as usize, fact("lit")? as usize);
        let stack = results.picture(Layer(run, ""))?;
        let (width, rows) = (stack.width as usize, stack.height as usize);
        if lit < LEAST {
            let what = format!("has {lit} lit frames, at least {LEAST} are needed");
            return Err(wrong(&what).help("Choose another date or latitude, or a shorter bake.interval"));
        }
        if rows % (lit + 1) != 0 {
            return Err(wrong(&format!("has {rows} rows for {lit} frames and the albedo")));
        }
        let height = rows / (lit + 1);
        let numbers = 0..lit;
        let seconds = numbers.clone().map(|t| fact(&format!("second {t}"))).collect::<Result<_>>()?;
        let channel = |name: &str, t: usize| fact(&format!("{name} {t}")).map(|value| value as f32);
        let sun = numbers.map(|t| Ok([channel("red", t)?, channel("green", t)?, channel("blue", t)?]));
        let sun = sun.collect::<Result<_>>()?;
        let method = results.experiment.methods.iter().find(|method| method.name == run.method);
        let method = method.ok_or_else(|| wrong("is no technique of the experiment"))?;
        let settings = kinds::find(&method.kind)?.effective(method, &run.variant)?;
        let options: DayOptions = serde_json::from_value(settings["day"].clone())
            .map_err(|error| wrong(&format!("has no day in its settings: {error}")))?;
        let white = stack.pixels[width * height..].to_vec();
        let mut day = Self {
            name: format!("{}, {}", run.scene, run.view),
            id: format!("{}-{}", run.scene, run.view),
            width,
            height,
            steps,
            seconds,
            sun,
            albedo: stack.pixels[..width * height].to_vec(),
            white,
            civil: options.day()?,
            options: Options::default(),
            bright: Vec::new(),
        };
        let means: Vec<f64> = (0..lit).map(|t| mean(&day.frame(t).pixels)).collect();
        let brightest = (0..lit).max_by(|a, b| means[*a].total_cmp(&means[*b])).unwrap_or(0);
        day.bright = means.iter().map(|mean| *mean > DARK * means[brightest]).collect();
        // Screens do not adapt from frame to frame: the brightest frame decides.
        let stops = Display::default().stops(&day.frame(brightest));
        day.options.display.exposure = Exposure::Stops(stops);
        day.options.pdiff_threshold = day.seen();
        Ok(day)
    }

    /// Number of lit times.
    pub fn len(&self) -> usize {
        self.seconds.len()
    }

    /// Pixels that must differ until two pictures are called different: the share that is 100 pixels of 800×600.
    pub fn seen(&self) -> u64 {
        ((SEEN * (self.width * self.height) as f64).round() as u64).max(1)
    }

    /// Exposure of the day, stops.
    pub fn stops(&self) -> f64 {
        match self.options.display.exposure {
            Exposure::Stops(stops) => stops,
            Exposure::Auto => 0.0,
        }
    }

    /// The frame at the place of the paper's number 121 within the lit day.
    pub fn frame_121(&self) -> usize {
        (((PAPER_FRAME - 0.5) / PAPER_LIT * self.len() as f64) as usize).min(self.len() - 1)
    }

    /// Whether a frame counts where errors are relative to its mean: it has at least a thousandth of the mean of the brightest frame.
    pub fn is_bright(&self, t: usize) -> bool {
        self.bright[t]
    }

    /// Local time, `07:40`.
    pub fn label(&self, t: usize) -> String {
        self.civil.label(self.seconds[t]).chars().take(5).collect()
    }

    /// Radiance of the sun's indirect light at a lit time.
    pub fn frame(&self, t: usize) -> Picture {
        let pixels = self.width * self.height;
        let scale = self.sun[t].map(|channel| channel / std::f32::consts::PI);
        let light = &self.white[t * pixels..][..pixels];
        let lit = light.iter().zip(&self.albedo).map(|(e, a)| std::array::from_fn(|c| scale[c] * e[c] * a[c]));
        self.picture(lit.collect())
    }

    /// A picture of the day's size.
    pub fn picture(&self, pixels: Vec<[f32; 3]>) -> Picture {
        Picture { width: self.width as u32, height: self.height as u32, pixels, display_referred: false }
    }

    /// PerceptualDiff at the exposure of the day.
    ///
    /// # Errors
    /// Those of the measure.
    pub fn pdiff(&self, truth: &Picture, test: &Picture) -> Result<Measured> {
        Measure::Pdiff.of(&Pair::new(truth, test)?, &self.options)
    }

    /// The largest root mean square error of a bright frame over its mean, %, from sums over all pixels and channels: of squared errors, and of
    /// light.
    pub fn worst(&self, squares: &[f64], light: &[f64]) -> f64 {
        let count = (3 * self.width * self.height) as f64;
        let of = |t: usize| 100.0 * (squares[t] * count).sqrt() / light[t];
        (0..self.len()).filter(|t| self.bright[*t]).map(of).fold(0.0, f64::max)
    }

    /// Rows of all times, one for each pixel and channel: of radiance, or of white irradiance. Pixels that never have light are left out.
    pub fn rows(&self, of: Of) -> Rows {
        let pixels: Vec<usize> = (0..self.width * self.height).collect();
        self.rows_of(of, &pixels)
    }

    /// The same of some pixels.
    pub fn rows_of(&self, of: Of, pixels: &[usize]) -> Rows {
        let (all, times) = (self.width * self.height, self.len());
        let (mut values, mut places) = (Vec::new(), Vec::new());
        for &pixel in pixels {
            if (0..times).all(|t| self.white[t * all + pixel] == [0.0; 3]) {
                continue;
            }
            for channel in 0..3 {
                let scale = self.albedo[pixel][channel] / std::f32::consts::PI;
                values.extend((0..times).map(|t| {
                    let light = self.white[t * all + pixel][channel];
                    match of {
                        Of::Radiance => light * self.sun[t][channel] * scale,
                        Of::White => light,
                    }
                }));
                places.push((pixel, channel));
            }
        }
        Rows { times, values, places }
    }
}

/// The light of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Of {
    /// What a picture shows, W/(sr m²).
    Radiance,
    /// Irradiance for a white sun of 1 W/m²: what a bake stores.
    White,
}

/// Rows of all times.
pub(super) struct Rows {
    pub times: usize,
    pub values: Vec<f32>,
    /// Pixel and channel of each row.
    pub places: Vec<(usize, usize)>,
}

impl Rows {
    /// Number of rows.
    pub fn len(&self) -> usize {
        self.places.len()
    }

    pub fn iter(&self) -> impl Iterator<Item = &[f32]> {
        self.values.chunks_exact(self.times.max(1))
    }

    /// Sum of each time.
    pub fn sums(&self) -> Vec<f64> {
        let mut sums = vec![0.0; self.times];
        for row in self.iter() {
            sums.iter_mut().zip(row).for_each(|(sum, value)| *sum += f64::from(*value));
        }
        sums
    }
}

/// Mean over pixels and channels.
pub(super) fn mean(pixels: &[[f32; 3]]) -> f64 {
    pixels.iter().flatten().map(|value| f64::from(*value)).sum::<f64>() / (3 * pixels.len()).max(1) as f64
}

/// Root mean square of the difference over the mean of the truth, %.
pub(super) fn relative_rms(truth: &Picture, test: &Picture) -> f64 {
    let square = |(a, b): (&f32, &f32)| (f64::from(*a) - f64::from(*b)).powi(2);
    let values = truth.pixels.as_flattened().iter().zip(test.pixels.as_flattened());
    let sum: f64 = values.map(square).sum();
    100.0 * (sum / (3 * truth.pixels.len()).max(1) as f64).sqrt() / mean(&truth.pixels)
}
