//! Tone mapping: from scene luminances to what a display can show.
//!
//! Three local operators (Ashikhmin 2002, Reinhard 2002, a bilateral one after Durand and Dorsey 2002), each global, local or selective
//! (Michael 2010, chapter 4), two that solve an equation for the whole picture (Fattal 2002, Mantiuk 2006: [`whole`]), and the curves that
//! programs offer beside them. [`Operator`] and [`Settings`] hold the definitions.
//!
//! Every local operator is in two parts, which is what makes it fit for selection: **local adaptation** L_a of each pixel, an average of
//! luminances around it ([`local`]), and a **curve** from L and L_a to display luminance, with statistics of the whole picture
//! ([`statistics`]). Global is L_a = L; selective is L_a = L where a pixel is not important.
//!
//! | want | use |
//! |---|---|
//! | tone mapping as the last passes of a frame | [`Tonemap::frame`] |
//! | pictures in main memory, of any size, one or many | [`Still`] |
//! | one picture | [`apply`] |
//!
//! The result is display-referred linear Rec. 709 relative to the display's white; encoding (sRGB or a gamma) is left to where it is
//! written. Shaders never spread NaN: they take it, infinity and negative values for 0; [`clean()`] offers other policies before.

pub mod bilateral;
mod clean;
pub mod identify;
mod keep;
pub mod local;
pub mod mark;
mod operator;
pub mod pyramid;
pub mod receptor;
pub mod search;
mod settings;
mod settle;
pub mod solve;
pub mod statistics;
mod still;
pub mod whole;

pub use clean::{BadCounts, clean};
pub use operator::Operator;
pub use settings::{BadValues, Identify, Local, Mark, Mode, NO_LIMIT, Settings, ThresholdUnit};
pub use still::{Mapped, Still, apply};

use crate::{
    Result,
    gpu::{Gpu, OwnedBuffer},
    graph::{Buffer, Extent, Format, Graph, Image},
    shaders::{consts, tonemap::curve, types},
};

/// What a frame starts from.
#[derive(Clone, Copy, Debug)]
pub struct Input {
    /// Linear Rec. 709, RGBA32F or RGBA16F, premultiplied.
    pub color: Image,
    /// Pixels that are important whatever their luminance: red over 0.5. Same extent as `color`.
    pub mask: Option<Image>,
}

impl From<Image> for Input {
    fn from(color: Image) -> Self {
        Self { color, mask: None }
    }
}

/// What a frame gives, all of the extent of the input.
#[derive(Clone, Copy, Debug)]
pub struct Output {
    /// RGBA32F: display-referred linear Rec. 709, 1 is the display's white; alpha is that of the input.
    pub mapped: Image,
    /// R32F: luminance after the exposure.
    pub luminance: Image,
    /// R32F: local adaptation, in the same unit; of the bilateral operator the luminance of the base; of Fattal's and Mantiuk's the display luminance.
    /// Global: `luminance`.
    pub adaptation: Image,
    /// One `types::TonemapStatistics`.
    pub statistics: Buffer,
    /// Selective: R32F, 1 where a pixel is important, 0 elsewhere.
    pub important: Option<Image>,
    /// Fattal and Mantiuk: one `types::TonemapSolve`, with the residual of the solution.
    pub solve: Option<Buffer>,
}

/// Tone mapping with its adaptation, which goes on from frame to frame.
#[derive(Debug)]
pub struct Tonemap {
    gpu: Gpu,
    settings: Settings,
    /// `types::TonemapStatistics` of the last frame.
    statistics: OwnedBuffer,
    /// Local adaptation of the last frame.
    last: settle::Last,
    /// Important pixels of an earlier frame.
    maps: keep::Maps,
}

impl Tonemap {
    /// Not adapted to anything yet.
    ///
    /// # Errors
    /// `Usage` if a setting is out of its range, `OutOfMemory`.
    pub fn new(gpu: &Gpu, settings: &Settings) -> Result<Self> {
        settings.validate()?;
        Ok(Self {
            gpu: gpu.clone(),
            settings: settings.clone(),
            statistics: no_statistics(gpu)?,
            last: settle::Last::default(),
            maps: keep::Maps::default(),
        })
    }

    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Goes on with other settings, without forgetting to what it is adapted.
    ///
    /// # Errors
    /// `Usage` if a setting is out of its range; then nothing has changed.
    pub fn set(&mut self, settings: &Settings) -> Result<()> {
        settings.validate()?;
        // A map that other settings have found does not count. It hardly depends on the exposure, which programs change often.
        if *settings != (Settings { exposure: settings.exposure, ..self.settings.clone() }) {
            self.maps = keep::Maps::default();
        }
        self.settings = settings.clone();
        Ok(())
    }

    /// Forgets to what it is adapted: for cuts. Frames already declared are not touched.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`.
    pub fn reset(&mut self) -> Result<()> {
        self.statistics = no_statistics(&self.gpu)?;
        self.last = settle::Last::default();
        self.maps = keep::Maps::default();
        Ok(())
    }

    /// Declares all passes. `dt`: seconds since the frame before, for adaptation in time; `None`: the picture stands for itself.
    ///
    /// # Errors
    /// `Usage` if the input asks for what the settings cannot serve.
    pub fn frame(&mut self, graph: &mut Graph, input: impl Into<Input>, dt: Option<f32>) -> Result<Output> {
        let input = input.into();
        let statistics = graph.import_buffer(&self.statistics);
        let known = self.last.known(&self.gpu, graph, graph.extent(input.color), dt, &self.settings)?;
        let map_of = self.maps.next(&self.gpu, graph, graph.extent(input.color), dt, &self.settings)?;
        graph.scope("tonemap", |graph| {
            let (luminance, sums) = statistics::whole(graph, input.color, statistics, dt, &self.settings);
            let picture = graph.extent(input.color);
            let receptor = (self.settings.operator == Operator::ReinhardDevlin).then(|| {
                let receptor = graph.buffer("tonemap.receptor", receptor::BYTES);
                let known = receptor::Known { sums, receptor, statistics, pixels: picture.pixels() };
                receptor::empty(graph, receptor);
                receptor::sums(graph, input.color, picture.into(), &known, &self.settings);
                receptor::range(graph, input.color, picture.into(), &known, &self.settings);
                known
            });
            let light = Light { luminance, statistics, receptor, picture, last: known, map: map_of };
            map(graph, &input, &light, &self.settings)
        })
    }
}

/// Light and statistics before the operator runs.
struct Light {
    luminance: Image,
    statistics: Buffer,
    /// Reinhard and Devlin.
    receptor: Option<receptor::Known>,
    /// Extent of the whole picture, of which the input may be a part.
    picture: Extent,
    /// Local adaptation of the last frame, if it goes on from it.
    last: Option<settle::Known>,
    /// Where the map of important pixels comes from.
    map: keep::Map,
}

/// Adaptation and curve.
fn map(graph: &mut Graph, input: &Input, light: &Light, settings: &Settings) -> Result<Output> {
    let Light { luminance, statistics, receptor, picture, last, map } = *light;
    let (mut important, mut solve) = (None, None);
    let adaptation = match settings.mode() {
        _ if settings.operator.solves() => {
            let (display, state) = whole::display(graph, luminance, statistics, settings)?;
            solve = Some(state);
            display
        }
        Mode::Global => luminance,
        Mode::Local => local::adaptation(graph, luminance, None, statistics, picture, settings)?,
        Mode::Selective => {
            let importance = map.importance(graph, luminance, statistics, input.mask, settings);
            important = Some(importance);
            mark::adapt(graph, luminance, importance, statistics, picture, settings)?
        }
    };
    let adaptation = match last {
        Some(last) => settle::settle(graph, adaptation, last),
        None => adaptation,
    };
    let mapped = match receptor {
        Some(known) => receptor::mapped(graph, input.color, &known, settings),
        None => curve(graph, input.color, adaptation, statistics, settings),
    };
    Ok(Output { mapped, luminance, adaptation, statistics, important, solve })
}

/// The curve of the operator for every pixel. [`Operator::ReinhardDevlin`] has its own passes ([`receptor`]); here it is linear.
pub fn curve(graph: &mut Graph, color: Image, adaptation: Image, statistics: Buffer, settings: &Settings) -> Image {
    let extent = graph.extent(color);
    let mapped = graph.image("tonemap.mapped", Format::RGBA32F, extent);
    let operator = match settings.operator {
        Operator::Ashikhmin => consts::TONEMAP_ASHIKHMIN,
        Operator::Reinhard => consts::TONEMAP_REINHARD,
        Operator::Bilateral => consts::TONEMAP_BILATERAL,
        Operator::Linear | Operator::ReinhardDevlin => consts::TONEMAP_LINEAR,
        Operator::ReinhardGlobal => consts::TONEMAP_REINHARD_GLOBAL,
        Operator::Aces => consts::TONEMAP_ACES,
        Operator::Agx => consts::TONEMAP_AGX,
        Operator::Neutral => consts::TONEMAP_NEUTRAL,
        Operator::Drago => consts::TONEMAP_DRAGO,
        Operator::Fattal | Operator::Mantiuk => consts::TONEMAP_SOLVED,
    };
    let push = curve::Push {
        exposure: settings.exposure.exp2(),
        display: settings.display,
        bias: settings.bias,
        key: settings.key,
        white: settings.white,
        log_contrast: settings.base_contrast.log10(),
        detail: settings.detail,
        saturation: settings.saturation(),
        limit: settings.contrast_limit().unwrap_or(0.0),
    };
    let spec = curve::Spec { operator, global: (settings.mode() == Mode::Global).into() };
    let args = curve::Args { color, adaptation, statistics, mapped, push, spec };
    graph.compute(args, [extent.width, extent.height.div_ceil(consts::TONEMAP_CURVE_ROWS)]);
    mapped
}

fn no_statistics(gpu: &Gpu) -> Result<OwnedBuffer> {
    OwnedBuffer::with_contents(gpu, "tonemap.statistics", bytemuck::bytes_of(&types::TonemapStatistics::default()))
}
