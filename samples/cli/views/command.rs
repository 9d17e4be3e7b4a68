//! `lucerna views`.

use std::path::{Path, PathBuf};

use lucerna::{Error, Result, image, scene::Pose};

use super::{NamedView, ViewList, draw, recorded};
use crate::{
    args::TalkArgs,
    camera::CameraFile,
    config,
    console::{self, Console},
    default_light::{self, DefaultLight},
    source::SceneArgs,
    terrain::Terrain,
};

/// Options of `lucerna views`.
#[derive(clap::Args, Clone, Debug)]
pub struct ViewsArgs {
    #[command(flatten)]
    pub scene: SceneArgs,

    /// Number of views; recorded views come first, the others are random
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub count: u32,

    /// Seed of the random views
    #[arg(long, value_name = "S", default_value_t = 1)]
    pub seed: u64,

    /// A recorded camera (.toml) to add to the list; may be given more than once
    #[arg(long, value_name = "FILE")]
    pub camera: Vec<PathBuf>,

    /// Leave the scene's own cameras out
    #[arg(long)]
    pub only_random: bool,

    /// The list to write (.toml) [default: standard output]
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,

    /// Overwrite an existing list
    #[arg(long)]
    pub overwrite: bool,

    #[command(flatten)]
    pub talk: TalkArgs,
}

/// Draws the views and writes the list.
///
/// # Errors
/// `Input` if the scene or a camera cannot be read, or too few views are found; `Output` if the list cannot be written.
pub fn run(args: &ViewsArgs, console: Console) -> Result<()> {
    if let Some(path) = &args.output {
        image::probe_output(path, args.overwrite)?;
    }
    let (mut scene, _) = args.scene.open()?;
    // `render` adds lights to dark scenes. The rule for dark views needs the same lights.
    default_light::add_missing_light(&mut scene, DefaultLight::Auto, None);
    let list = list(&scene, args)?;
    let heading = "# Written by `lucerna views`; `render --camera FILE.toml#NAME` takes one view. Lengths in metres.\n";
    let text = format!("{heading}{}", config::to_toml(&list)?);
    match &args.output {
        Some(path) => {
            image::write_atomic(path, text.as_bytes(), args.overwrite)?;
            console.info(&format!("wrote {} views to {}", list.views.len(), path.display()));
            Ok(())
        }
        None => console::print(text.trim_end()),
    }
}

fn list(scene: &lucerna::scene::Scene, args: &ViewsArgs) -> Result<ViewList> {
    let pose = Pose::playing(scene, 0.0);
    let land = args.scene.terrain.as_ref().map(Terrain::file);
    let (named, stem) = match (&args.scene.builtin, args.scene.scene.as_deref().or(land)) {
        (Some(name), _) => (name.clone(), name.clone()),
        (None, Some(path)) => (path.to_string_lossy().into_owned(), stem(path)),
        (None, None) => return Err(Error::usage("no scene was given")),
    };
    let mut views = Vec::new();
    for path in &args.camera {
        views.push(NamedView::recorded(self::stem(path), &CameraFile::read(path)?));
    }
    if !args.only_random {
        views.extend(recorded(scene, &pose));
    }
    views.truncate(args.count as usize);
    let missing = args.count as usize - views.len();
    if missing > 0 {
        views.extend(draw::views(scene, &pose, &stem, missing, args.seed)?);
    }
    let mut seen = std::collections::HashSet::new();
    if let Some(twice) = views.iter().find(|view| !seen.insert(view.name.as_str())) {
        return Err(Error::usage(format!("two views would be named '{}'", twice.name)).help("Rename a camera file"));
    }
    Ok(ViewList { scene: named, seed: args.seed, views })
}

fn stem(path: &Path) -> String {
    path.file_stem().map_or_else(|| "scene".into(), |stem| stem.to_string_lossy().into_owned())
}
