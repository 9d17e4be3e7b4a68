//! `fiv render`: pictures by vectors from a file, computed before the first frame, or in each frame.

use std::{path::PathBuf, process::ExitCode};

use lucerna::{
    Result,
    scene::{Pose, bvh::Bvh},
    technique::{AllLight, Bake},
    techniques::fiv::{Baked, Fiv, Method, PictureSettings, Settings},
};

use crate::{
    args::RenderArgs,
    interior::Survey,
    last_stage::Staged,
    render::{self, Given},
    stage::Stage,
};

/// Texels along an edge of the environment's cube in a quick picture of a scene that fills the picture: a quarter of the rays of other scenes.
const COARSE: u32 = 8;

/// Options of `fiv render`.
#[derive(clap::Args, Debug)]
pub struct FivArgs {
    #[command(flatten)]
    pub common: RenderArgs,

    /// File of `fiv precompute`; vectors that the file does not contain are computed
    #[arg(long, value_name = "FILE.fiv", help_heading = "Technique")]
    pub vectors: Option<PathBuf>,

    /// Compute as many vectors as `fiv precompute` does by default, which takes a CPU minutes. Without this option and without --vectors, few vectors are
    /// computed, and only those that the picture needs (fiv.method=online) unless the settings ask for all
    #[arg(long, conflicts_with = "vectors", help_heading = "Technique")]
    pub full: bool,
}

/// Renders the frames of a command line. `stage`: the scene and the camera, if they were read already.
///
/// # Errors
/// Any error of the run. Its kind decides the exit code.
pub fn render(args: &FivArgs, stage: Option<Stage>) -> Result<ExitCode> {
    let baked = args.vectors.as_deref().map(Baked::read).transpose()?;
    let mut given = Given::<Fiv>::by(&args.common, AllLight)?;
    let mut stage = stage;
    if baked.is_none() && !args.full {
        preview(args, &mut given, &mut stage)?;
    }
    if let Some(baked) = &baked {
        // The settings in the picture's metadata are then sufficient to render the picture again.
        given.base.fiv = baked.stored.plan.settings(&given.base.fiv);
    }
    render::render_on(stage, &args.common, &Given { baked, ..given })
}

/// A first picture takes seconds and has no smears: only the vectors that its pixels look up are computed, and few of them. Settings of the user hold.
fn preview(args: &FivArgs, given: &mut Given<Fiv>, stage: &mut Option<Stage>) -> Result<()> {
    let settings = &args.common.settings;
    let over = |fiv: Settings| -> Result<Settings> {
        let base = PictureSettings { fiv, ..given.base.clone() };
        Ok(Staged::effective(settings, &base, args.common.paper, PictureSettings::validate)?.technique.fiv)
    };
    let full = over(given.base.fiv.clone())?;
    if !matches!(full.method, Method::Vectors | Method::Online) {
        return Ok(());
    }
    let mut fewer = Settings::preview();
    let chosen = over(Settings { method: Method::Online, ..fewer.clone() });
    // Some settings need stored vectors.
    let stored = full.of_stored_vectors() != given.base.fiv.of_stored_vectors();
    if !stored && chosen.is_ok() {
        fewer.method = Method::Online;
    }
    if !settings.print_config {
        let stage = match stage {
            Some(stage) => stage,
            None => stage.insert(Stage::open(&args.common.stage)?),
        };
        if over(fewer.clone())?.method == Method::Online && fills_the_picture(stage) {
            fewer.size = COARSE;
        }
    }
    let chosen = over(fewer.clone())?;
    given.base.fiv = fewer;
    if full != chosen && !settings.print_config {
        let which =
            if chosen.method == Method::Online { "only the vectors that the picture needs" } else { "few vectors" };
        args.common.talk.console().info(&format!(
            "note: {which} are computed, for a quick picture; --full computes all of them, and `fiv precompute` writes all into a file for --vectors",
        ));
    }
    Ok(())
}

/// Whether the scene is a room, or a single mesh: each pixel then shows a surface that shadows itself, which takes many rays.
fn fills_the_picture(stage: &Stage) -> bool {
    let scene = &stage.scene;
    if scene.nodes.iter().filter(|node| node.mesh.is_some()).count() == 1 {
        return true;
    }
    let bvh = Bvh::build(scene, &Pose::playing(scene, 0.0));
    Survey::of(&bvh).is_some_and(|survey| survey.interior().is_some())
}
