//! `lucerna export-pov`: a scene and a view as a POV-Ray 3.7 file, as the image-space radiosity dissertation made its model images
//! (section 5.2.4, listing 9, table 1).
//!
//! Coordinates stay those of the scene (right-handed, Y up). POV-Ray is left-handed only through its default camera; ours
//! names all three vectors, so that nothing has to be mirrored.

mod material;
mod mesh;
pub mod povray;
mod stage;
pub mod text;

use std::path::{Path, PathBuf};

use lucerna::{
    Error, Result, image,
    scene::{Pose, Scene, View, bvh::Bvh},
};
use serde::{Deserialize, Serialize};

use crate::{
    args::{TalkArgs, positive},
    config::{self, SettingsArgs},
    console, program,
    signals::Interrupt,
    stage::{Stage, StageArgs},
};

/// Settings besides the scene. The defaults of the radiosity block are table 1 of the dissertation.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    pub pov: Pov,
}

/// The settings of the export.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Pov {
    /// Computes indirect light.
    pub radiosity: bool,
    /// Factor on gathered light at every bounce; 1 keeps energy, 2.4 is the paper's.
    pub brightness: f32,
    /// Size of the first pre-trace pass' blocks, share of the picture's width.
    pub pretrace_start: f32,
    /// Size of the last pass' blocks.
    pub pretrace_end: f32,
    /// Rays for each gathering.
    pub count: u32,
    /// Share of error tolerated when gathered values are reused.
    pub error_bound: f32,
    /// Bounces.
    pub recursion_limit: u32,
    /// Number of point lights that replace emissive surfaces, distributed by power; 0: emissive surfaces light other surfaces by
    /// radiosity only.
    pub emissive_lights: u32,
    /// Lights cast shadows. Those of the dissertation's listing 9 cast none.
    pub shadows: bool,
    /// Share of its colour that every matt surface without emission shows without any light, and sends to other surfaces. POV-Ray 3.6 has 0.1 where a file names none.
    pub ambient: f32,
}

impl Default for Pov {
    fn default() -> Self {
        Self {
            radiosity: true,
            brightness: 2.4,
            pretrace_start: 0.08,
            pretrace_end: 0.01,
            count: 250,
            error_bound: 0.25,
            recursion_limit: 2,
            emissive_lights: 64,
            shadows: true,
            ambient: 0.0,
        }
    }
}

impl Pov {
    /// Energy-conserving bounces, gathered more finely than in the paper, for comparison with path tracing.
    pub fn physical(bounces: u32) -> Self {
        Self {
            brightness: 1.0,
            count: 800,
            error_bound: 0.1,
            pretrace_end: 0.005,
            recursion_limit: bounces.max(1),
            radiosity: bounces > 0,
            ..Self::default()
        }
    }

    pub(crate) fn check(&self) -> Result<()> {
        let range = |name: &str, value: f32, low: f32, high: f32| {
            if (low..=high).contains(&value) {
                return Ok(());
            }
            Err(Error::usage(format!("pov.{name} is {value}, allowed is {low} to {high}")))
        };
        range("brightness", self.brightness, 0.0, 1e6)?;
        range("pretrace_start", self.pretrace_start, 1e-4, 1.0)?;
        range("pretrace_end", self.pretrace_end, 1e-4, self.pretrace_start)?;
        range("count", self.count as f32, 1.0, 1600.0)?;
        range("error_bound", self.error_bound, 1e-3, 100.0)?;
        range("recursion_limit", self.recursion_limit as f32, 1.0, 20.0)?;
        range("emissive_lights", self.emissive_lights as f32, 0.0, 65536.0)?;
        range("ambient", self.ambient, 0.0, 1e6)
    }
}

/// A scene file, its images, and notes about differences.
#[derive(Clone, Debug, Default)]
pub struct Export {
    pub text: String,
    /// Names relative to the scene file, and contents.
    pub images: Vec<(String, Vec<u8>)>,
    /// Notes about parts that POV-Ray renders differently.
    pub notes: Vec<String>,
}

/// Exports `scene` in `pose`, seen through `view`. `stem`: start of the images' names.
///
/// # Errors
/// `Usage` for settings out of range, `Input` for a scene without surfaces.
pub fn export(scene: &Scene, pose: &Pose, view: &View, settings: &Pov, stem: &str) -> Result<Export> {
    settings.check()?;
    let bvh = Bvh::build(scene, pose);
    let (low, high) = bvh.bounds().ok_or_else(|| Error::input("the scene has no surface"))?;
    let units = text::units_per_metre((high - low).length());
    // The stem is written between quotes in the file.
    let stem: String = stem.chars().map(|c| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '_' }).collect();
    let stem = stem.as_str();
    let mut out = Export::default();
    let mut body = String::new();
    stage::globals(&mut body, settings);
    stage::camera(&mut body, view, units);
    stage::sky(&mut body, scene, stem, &mut out)?;
    stage::lights(&mut body, scene, pose, units, ((low, high), settings.shadows), &mut out.notes);
    if settings.emissive_lights > 0 {
        stage::emitters(&mut body, scene, pose, &bvh, units, settings, &mut out.notes);
    } else if scene.materials.iter().any(|m| m.emissive.max_element() > 0.0 && !m.unlit) {
        out.notes.push("emissive surfaces light other surfaces by radiosity only".into());
    }
    let looks = material::looks(scene, stem, settings, &mut out)?;
    mesh::all(&mut body, scene, pose, view, units, &looks, &mut out.notes);
    let [width, height] = view.extent;
    let mut head = format!(
        "// {} by lucerna {}. Linear radiance, W/(sr m2), by:\n//   povray +I{stem}.pov +O{stem}.exr +FE +W{width} +H{height} -D\n\
         // 1 metre is {units} units.\n",
        text::comment(&scene.name),
        program::VERSION
    );
    for note in &out.notes {
        head.push_str(&format!("// Note: {}\n", text::comment(note)));
    }
    out.text = head + "#version 3.7;\n" + &body;
    Ok(out)
}

impl Export {
    /// Writes the file and its images beside it, the scene last: all of them or none.
    ///
    /// # Errors
    /// `Output` if one cannot be written or is there already.
    pub fn write(&self, path: &Path, overwrite: bool) -> Result<()> {
        let folder = path.parent().unwrap_or(Path::new(""));
        image::probe_output(path, overwrite)?;
        for (name, _) in &self.images {
            image::probe_output(&folder.join(name), overwrite)?;
        }
        let paths: Vec<PathBuf> = self.images.iter().map(|(name, _)| folder.join(name)).collect();
        let images = paths.iter().zip(&self.images).map(|(path, (_, bytes))| (path.as_path(), bytes.as_slice()));
        let all: Vec<(&Path, &[u8])> = images.chain([(path, self.text.as_bytes())]).collect();
        image::write_all_atomic(&all, overwrite)
    }
}

/// Options of `lucerna export-pov`.
#[derive(clap::Args, Clone, Debug)]
pub struct ExportPovArgs {
    #[command(flatten)]
    pub stage: StageArgs,
    /// File to write, ending in .pov; images that it needs are written beside it
    #[arg(short, long, value_name = "FILE.pov")]
    pub output: Option<PathBuf>,
    /// Overwrite existing files
    #[arg(long)]
    pub overwrite: bool,
    #[command(flatten)]
    pub settings: SettingsArgs,
    /// Also render it: runs `povray` and writes the linear picture to this .exr, .hdr, .pfm or .png file
    #[arg(long, value_name = "FILE")]
    pub render: Option<PathBuf>,
    /// Give up rendering after this many seconds
    #[arg(long, value_name = "S", default_value_t = 3600.0, value_parser = positive)]
    pub time_limit: f64,
    #[command(flatten)]
    pub talk: TalkArgs,
}

/// Runs `lucerna export-pov`.
///
/// # Errors
/// Any error of the run. Its kind decides the exit code.
pub fn run(args: &ExportPovArgs) -> Result<()> {
    let console = args.talk.console();
    let settings: Settings = args.settings.effective(&Settings::default())?;
    settings.pov.check()?;
    if args.settings.print_config {
        return console::print(config::to_toml(&settings)?.trim_end());
    }
    let output = match (&args.output, &args.render) {
        (Some(path), _) if path.extension().is_none_or(|e| !e.eq_ignore_ascii_case("pov")) => {
            return Err(Error::usage("the output is not named .pov").in_file(path));
        }
        (None, None) => {
            return Err(Error::usage("no output").help("Name one with -o FILE.pov, or render with --render"));
        }
        (path, _) => path.as_deref(),
    };
    if let Some(picture) = &args.render {
        image::Format::from_path(picture)?;
        image::probe_output(picture, args.overwrite)?;
        povray::find()?;
    }
    let stage = Stage::open(&args.stage)?;
    stage.notes().iter().for_each(|note| console.info(&format!("note: {}: {}", note.place, note.text)));
    let (pose, view) = stage.at(args.stage.time, args.stage.size)?;
    let stem = output.and_then(Path::file_stem).map_or("scene".into(), |s| s.to_string_lossy().into_owned());
    let exported = export(&stage.scene, &pose, &view, &settings.pov, &stem)?;
    exported.notes.iter().for_each(|note| console.info(&format!("note: {note}")));
    if let Some(path) = output {
        exported.write(path, args.overwrite)?;
        console.info(&format!("{} and {} images", path.display(), exported.images.len()));
    }
    if let Some(picture) = &args.render {
        let options = povray::Options {
            time_limit: std::time::Duration::from_secs_f64(args.time_limit.min(1e9)),
            ..Default::default()
        };
        Interrupt::install();
        let rendered = povray::render(&exported, args.stage.size, &options)?;
        let options = image::WriteOptions { overwrite: args.overwrite, ..Default::default() };
        image::write(picture, &rendered.picture, &options)?;
        console.info(&format!("{}: {:.1} s by {}", picture.display(), rendered.seconds, rendered.version));
    }
    Ok(())
}
