//! One picture: from a layer of its file through the operator to the output files.

use std::{
    io::Write,
    path::Path,
    time::{Duration, Instant},
};

use lucerna::{
    Error, ErrorKind, Result,
    gpu::Description,
    image::{self, Format, Layer, Layers, Metadata, WriteOptions},
    techniques::tonemap::{BadCounts, BadValues, Mode, Operator, Settings, Still},
};
use serde_json::{Value, json};

use super::{
    Config, PIPE, Run,
    alpha::{self, Alpha},
    args::Metering,
    auto_exposure,
    names::Input,
    recipe::Recipe,
};
use crate::{config, console::Console, outputs::ALPHA_LEFT_OUT, program};

/// A picture that was written.
#[derive(Debug)]
pub(super) struct Done {
    input: String,
    frame: Option<u32>,
    size: [u32; 2],
    alpha: bool,
    pub files: Vec<String>,
    bad: BadCounts,
    /// The exposure that was used, stops.
    exposure: f32,
    /// Minimum, maximum and log-average of the luminance after the exposure, as the operator used them.
    light: [f32; 3],
    /// Number of pixels with a channel above the screen's white, which .png and .jpg clip.
    over_white: u64,
    /// Number of pixels that a .png file with alpha shows darker than they are; `None`: no alpha, or not kept.
    hidden: Option<u64>,
    /// Number of pixels that selective tone mapping has marked.
    important: Option<u64>,
    pub reading: Duration,
    mapping: Duration,
    /// Time without reading and writing.
    pub working: Duration,
    pub writing: Duration,
}

/// A mapped picture, and its output files.
#[derive(Debug)]
pub(super) struct Unwritten {
    files: Vec<(String, Format)>,
    layers: Layers,
    options: WriteOptions,
    /// Share of the pixels whose light alpha hides in .png files.
    hidden: f64,
    console: Console,
}

/// Share of the pixels whose light alpha may hide without a warning: rims and glints.
const HIDDEN: f64 = 0.01;

impl Unwritten {
    /// Writes all files. Returns their names and the time.
    pub(super) fn write(self) -> Result<(Vec<String>, Duration)> {
        let begun = Instant::now();
        for (name, format) in &self.files {
            let report = if name == PIPE {
                let (bytes, report) = image::encode(*format, &self.layers, &self.options)?;
                let mut out = std::io::stdout().lock();
                out.write_all(&bytes).and_then(|()| out.flush()).map_err(|error| {
                    Error::new(ErrorKind::Output, "could not write to standard output").caused_by(error)
                })?;
                report
            } else {
                image::write(Path::new(name), &self.layers, &self.options)?
            };
            let share = percent(self.hidden);
            if report.alpha_left_out {
                self.console
                    .warning(&format!("{name}: {ALPHA_LEFT_OUT}; {share} of the pixels shine where alpha hides them"));
            } else if *format == Format::Png && self.hidden > HIDDEN {
                self.console.warning(&format!(
                    "{name}: alpha hides light in {share} of the pixels; --alpha drop shows all light, over black; an .exr file keeps both"
                ));
            }
        }
        Ok((self.files.into_iter().map(|(name, _)| name).collect(), begun.elapsed()))
    }

    /// The picture as layers, with the options for writing it.
    pub(super) fn into_layers(self) -> (Layers, WriteOptions) {
        (self.layers, self.options)
    }

    /// Whether the picture is small enough to stay in memory while the next picture is processed.
    pub(super) fn is_small(&self) -> bool {
        u64::from(self.layers.width) * u64::from(self.layers.height) <= KEPT_PIXELS
    }
}

/// Maximum of pixels of a picture that is written while the next one is processed.
const KEPT_PIXELS: u64 = 1 << 25;

/// As `--mode` takes it.
pub(super) fn mode_name(settings: &Settings) -> &'static str {
    match settings.mode() {
        Mode::Global => "global",
        Mode::Local => "local",
        Mode::Selective => "selective",
    }
}

/// The layer of a picture as RGBA, and whether its alpha is its own.
pub(super) fn pixels(picture: &Layers, asked: Option<&str>) -> Result<(Vec<[f32; 4]>, bool)> {
    let names = || picture.layers.iter().map(|l| if l.name.is_empty() { "total" } else { &l.name }).collect::<Vec<_>>();
    let layer = match asked {
        None => picture.main(),
        Some(name) => picture.layer(name),
    };
    let layer = layer.ok_or_else(|| {
        Error::input(format!("no layer {:?}; there are {}", asked.unwrap_or_default(), names().join(", ")))
    })?;
    let [r, g, b] = layer.colours().ok_or_else(|| {
        let channels = layer.channels.join(" ");
        Error::input(format!("the channels {channels} are no colours"))
            .help(format!("Name a layer of colours with --layer; there are {}", names().join(", ")))
    })?;
    let alpha = layer.channel("A").filter(|_| layer.channels.len() > 1);
    let count = layer.channels.len();
    let rgba = |p: &[f32]| [p[r], p[g], p[b], alpha.map_or(1.0, |a| p[a])];
    Ok((layer.data.chunks_exact(count).map(rgba).collect(), alpha.is_some()))
}

impl Run {
    /// Tone maps a picture. The caller writes its files.
    pub(super) fn develop(
        &mut self,
        still: &mut Still,
        about: &Description,
        input: &Input,
        mut picture: Layers,
    ) -> Result<(Done, Unwritten)> {
        let begun = Instant::now();
        let (width, height) = (picture.width, picture.height);
        let (pixels, alpha) = pixels(&picture, input.layer.as_deref())?;
        picture.warnings.iter().for_each(|what| self.console.warning(&format!("{}: {what}", input.name)));
        // Frees the input, because pictures can be very large.
        picture.layers.clear();
        let settings = self.exposed(input, &picture, &pixels);
        still.tonemap().set(&settings)?;
        let mask = self.mask(width, height)?;
        let dt = input.sequence.map(|_| {
            let frames =
                self.before.filter(|_| input.sequence == Some(false)).map_or(1, |b| input.frame.abs_diff(b).max(1));
            (f64::from(frames) / self.making.fps) as f32
        });
        self.before = Some(input.frame);
        let mut mapped = still.map(width, height, pixels, mask.as_deref(), dt)?;
        self.tell_bad(input, &mapped.bad);
        if mapped.statistics.frame_high == 0.0 {
            self.console.warning(&format!("{}: nothing in the picture is brighter than black", input.name));
        }
        let count = mapped.pixels.len() as f64;
        if let Some(important) = mapped.important {
            let share = percent(important as f64 / count);
            self.console.info(&format!("note: {}: {share} of the pixels are marked as detail", input.name));
        }
        let with_alpha = alpha && Alpha::apply(self.making.alpha, &mut mapped.pixels);
        let hidden = with_alpha.then(|| alpha::hidden(&mapped.pixels));
        let mapping = begun.elapsed();

        let over = |pixel: &&[f32; 4]| pixel[..3].iter().any(|&v| v > 1.0);
        let over_white = mapped.pixels.iter().filter(over).count() as u64;
        let (bad, s, important) = (mapped.bad, mapped.statistics, mapped.important);
        let layers = Layers {
            metadata: self.metadata(about, input, &picture, &settings)?,
            ..Layers::new(width, height).with(layer_of(mapped.pixels, with_alpha))
        };
        let files = self.files(input);
        for (name, _) in files.iter().filter(|(_, format)| with_alpha && *format == Format::Jpeg) {
            self.console.detail(&format!("{name}: .jpg holds no alpha; the picture is shown over black"));
        }
        let done = Done {
            input: input.name.clone(),
            frame: input.sequence.map(|_| input.frame),
            size: [width, height],
            alpha,
            files: Vec::new(),
            bad,
            exposure: settings.exposure,
            light: [s.low, s.high, s.log_average],
            over_white,
            hidden,
            important,
            reading: Duration::ZERO,
            mapping,
            working: Duration::ZERO,
            writing: Duration::ZERO,
        };
        let hidden = hidden.unwrap_or(0) as f64 / count;
        Ok((done, Unwritten { files, layers, options: self.write_options(), hidden, console: self.console }))
    }

    /// The settings of a picture, with the exposure that is found for it.
    fn exposed(&mut self, input: &Input, picture: &Layers, pixels: &[[f32; 4]]) -> Settings {
        let mut settings = self.settings().clone();
        let stated = match self.making.metering {
            Metering::None => return settings,
            Metering::Auto => None,
            Metering::ByFile => white_luminance(picture).filter(|_| settings.operator == Operator::Ashikhmin),
        };
        let within_sequence = input.sequence == Some(false);
        let stops = match (stated, self.metered.filter(|_| within_sequence)) {
            (Some(white), _) => white.log2(),
            (None, Some(stops)) => stops,
            (None, None) => auto_exposure::stops(pixels, settings.operator),
        };
        self.metered = Some(stops);
        settings.exposure = (settings.exposure + stops).clamp(-40.0, 40.0);
        // These operators scale the picture themselves.
        let scales_itself = matches!(settings.operator, Operator::Reinhard | Operator::Bilateral | Operator::Drago)
            || settings.operator.solves();
        if !within_sequence && !scales_itself {
            let why = match stated {
                Some(white) => format!("the file states white as {white} cd/m²"),
                None => "measured; --exposure 0 takes the light as it is".into(),
            };
            self.console.info(&format!("note: {}: exposure {:+.2} EV ({why})", input.name, settings.exposure));
        }
        settings
    }

    fn mask(&self, width: u32, height: u32) -> Result<Option<Vec<f32>>> {
        let (Some(mask), Some(path)) = (&self.mask, &self.making.mask) else { return Ok(None) };
        if [mask.width, mask.height] != [width, height] {
            let (w, h) = (mask.width, mask.height);
            return Err(
                Error::input(format!("the mask has {w}×{h} pixels, the picture {width}×{height}")).in_file(path)
            );
        }
        let (pixels, _) = pixels(mask, None).map_err(|error| error.in_file(path))?;
        Ok(Some(pixels.into_iter().map(|pixel| pixel[0]).collect()))
    }

    fn tell_bad(&self, input: &Input, bad: &BadCounts) {
        let Some([x, y]) = bad.first else { return };
        let mut parts = Vec::new();
        for (count, what) in [(bad.nan, "NaN"), (bad.infinite, "infinite"), (bad.negative, "negative")] {
            if count > 0 {
                parts.push(format!("{count} {what}"));
            }
        }
        let policy = match self.settings().bad_values {
            BadValues::Zero => "taken as 0",
            BadValues::Clamp => "NaN and negative taken as 0, infinite as the brightest",
            BadValues::Neighbour => "replaced by their neighbours, negative taken as 0",
            BadValues::Error => "refused",
        };
        if bad.below_black > 0 {
            let why = "light below 0, which is taken as 0 and looks black: often rings of resizing or compression in the file";
            self.console.info(&format!("note: {}: {} pixels have {why}", input.name, bad.below_black));
        }
        let text = format!("{}: samples: {}; {policy}; the first at ({x}, {y})", input.name, parts.join(", "));
        // Negative samples are usual for colours outside of the gamut, so they are no reason for a warning.
        if bad.nan + bad.infinite > 0 { self.console.warning(&text) } else { self.console.detail(&text) }
    }

    fn metadata(&self, about: &Description, input: &Input, picture: &Layers, settings: &Settings) -> Result<Metadata> {
        let source = &picture.metadata;
        let recipe = Recipe::new(&self.making, &Config { tonemap: settings.clone() }, input, &source.config)?;
        Ok(Metadata {
            program: "tonemap".into(),
            version: program::VERSION.into(),
            revision: program::revision().map(str::to_owned),
            technique: format!("{}-{}", self.settings().operator.name(), mode_name(self.settings())),
            device: about.device.clone(),
            driver: format!("{} {}", about.driver, about.driver_info).trim().to_owned(),
            shader_compiler: lucerna::shaders::COMPILER.to_owned(),
            config: config::to_value(&recipe)?,
            ..source.clone()
        })
    }
}

/// The luminance of red, green and blue of 1 by the attribute `whiteLuminance` of an EXR file, cd/m².
///
/// The `EXPOSURE` of an .hdr file is no such unit: programs write 1 for files whose values have no unit. Pixels are divided by it when they are read.
fn white_luminance(picture: &Layers) -> Option<f32> {
    let stated = picture.metadata.extra.get("whiteLuminance")?.parse::<f32>().ok()?;
    Some(stated).filter(|white| (1e-6..=1e9).contains(white))
}

fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

/// The layer to write: three channels, or four with alpha.
fn layer_of(pixels: Vec<[f32; 4]>, alpha: bool) -> Layer {
    let mut data = pixels.into_flattened();
    if alpha {
        return Layer::new("", &["R", "G", "B", "A"], data);
    }
    // Converts in place, because pictures can be very large.
    let count = data.len() / 4;
    for i in 1..count {
        data.copy_within(4 * i..4 * i + 3, 3 * i);
    }
    data.truncate(3 * count);
    Layer::new("", &["R", "G", "B"], data)
}

impl Done {
    /// Adds the names of the written files, and the time of writing.
    pub(super) fn with(self, (files, writing): (Vec<String>, Duration)) -> Self {
        Self { files, writing, ..self }
    }

    /// Time from reading to writing, summed over all threads.
    pub(super) fn milliseconds(&self) -> f64 {
        (self.reading + self.working + self.writing).as_secs_f64() * 1e3
    }

    pub(super) fn json(&self) -> Value {
        let milliseconds = |time: Duration| time.as_secs_f64() * 1e3;
        let finite = |value: f32| value.is_finite().then_some(value);
        let pixels = f64::from(self.size[0]) * f64::from(self.size[1]);
        let share = |count: u64| count as f64 / pixels;
        json!({
            "input": self.input,
            "frame": self.frame,
            "files": self.files,
            "width": self.size[0],
            "height": self.size[1],
            "alpha": self.alpha,
            "bad_samples": {
                "nan": self.bad.nan,
                "infinite": self.bad.infinite,
                "negative": self.bad.negative,
                "first": self.bad.first,
            },
            "exposure": self.exposure,
            "luminance": { "low": finite(self.light[0]), "high": finite(self.light[1]), "log_average": finite(self.light[2]) },
            "pixels_over_white": self.over_white,
            "share_marked": self.important.map(share),
            "share_hidden_by_alpha": self.hidden.map(share),
            "milliseconds": {
                "read": milliseconds(self.reading),
                "map": milliseconds(self.mapping),
                "write": milliseconds(self.writing),
            },
        })
    }
}
