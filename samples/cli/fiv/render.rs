//! `fiv render`: pictures by vectors from a file, computed before the first frame, or in each frame.

use std::{path::PathBuf, process::ExitCode};

use lucerna::{
    Result,
    scene::Scene,
    technique::{AllLight, Bake},
    techniques::fiv::{Baked, Fiv, Method, PictureSettings, Settings, Specular},
};

use crate::{
    args::RenderArgs,
    interior::is_room,
    last_stage::Staged,
    render::{self, Given},
    stage::Stage,
};

/// Texels along an edge of the environment's cube in a quick picture of a scene that fills the picture or has metals: a quarter of the rays of other scenes.
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
pub fn render(args: &FivArgs, mut stage: Option<Stage>) -> Result<ExitCode> {
    let baked = args.vectors.as_deref().map(Baked::read).transpose()?;
    let mut given = Given::<Fiv>::by(&args.common, AllLight)?;
    if baked.is_none() && !args.full {
        preview(args, &mut given, &mut stage)?;
    }
    if let Some(baked) = &baked {
        // The settings in the picture's metadata are then sufficient to render the picture again.
        given.base.fiv = baked.stored.plan.settings(&given.base.fiv);
    }
    render::render_on(stage, &args.common, &Given { baked, ..given })
}

/// Replaces the defaults by those of a picture in seconds: few vectors, and only those that its pixels look up. Settings of the user stay. Reads the
/// scene, if it is named.
fn preview(args: &FivArgs, given: &mut Given<Fiv>, stage: &mut Option<Stage>) -> Result<()> {
    let RenderArgs { settings, paper, stage: place, talk, .. } = &args.common;
    let over = |fiv: Settings| -> Result<Settings> {
        let base = PictureSettings { fiv, ..given.base.clone() };
        Ok(Staged::effective(settings, &base, *paper, PictureSettings::validate)?.technique.fiv)
    };
    let full = over(given.base.fiv.clone())?;
    if !matches!(full.method, Method::Vectors | Method::Online) {
        return Ok(());
    }
    if stage.is_none() && place.scene.is_named() {
        *stage = Some(Stage::open(place)?);
    }
    let scene = stage.as_ref().map(|stage| &stage.scene);
    let stored = Settings::preview();
    let online = Settings { method: Method::Online, ..stored.clone() };
    // Metals are black without their glossy reflection, whose time grows with the number of texels.
    let glossy = Settings { size: COARSE, specular: Specular::Summed, ..stored.clone() };
    let needs_stored = full.of_stored_vectors() != given.base.fiv.of_stored_vectors() || over(online.clone()).is_err();
    let mut fewer = if needs_stored { stored } else { online };
    if scene.is_some_and(has_metals) && over(glossy.clone()).is_ok_and(|chosen| chosen.specular == Specular::Summed) {
        fewer = glossy;
    }
    let online = over(fewer.clone())?.method == Method::Online;
    if online && scene.is_some_and(fills_the_picture) {
        fewer.size = COARSE;
    }
    if full != over(fewer.clone())? && !settings.print_config {
        let which = if online { "only the vectors that the picture needs" } else { "few vectors" };
        talk.console().info(&format!(
            "note: {which} are computed, for a quick picture; --full computes all of them, and `fiv precompute` writes all into a file for --vectors",
        ));
    }
    given.base.fiv = fewer;
    Ok(())
}

/// Whether a mesh of the scene is of metal.
pub fn has_metals(scene: &Scene) -> bool {
    let used = scene.nodes.iter().filter_map(|node| scene.meshes.get(node.mesh? as usize));
    used.flat_map(|mesh| &mesh.primitives).any(|primitive| scene.materials[primitive.material as usize].is_metal())
}

/// Whether the scene is a room, or a single mesh: each pixel then shows a surface that shadows itself, which takes many rays.
fn fills_the_picture(scene: &Scene) -> bool {
    scene.nodes.iter().filter(|node| node.mesh.is_some()).count() == 1 || is_room(scene)
}
