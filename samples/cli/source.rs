//! The scene options of a command line.

use std::path::{Path, PathBuf};

use lucerna::{
    Error, Result, image,
    scene::{self, Environment, Limits, LoadOptions, Note, Scene, environment},
};
use lucerna_scenes as builtin;

use crate::{
    added::{self, Added},
    args::positive,
    changed::{self, Change},
    config::nearest,
    ground::GroundArgs,
    record::Source,
    terrain::Terrain,
};

/// The options `SCENE`, `--builtin NAME`, `--unit`, `--add`, `--set`, `--terrain`, and those of `--ground`.
#[derive(clap::Args, Clone, Debug, Default)]
pub struct SceneArgs {
    /// Scene file: .gltf, .glb or .obj, also inside a .zip
    #[arg(value_name = "SCENE")]
    pub scene: Option<PathBuf>,

    /// A built-in scene instead of a file (`lucerna list` lists them)
    #[arg(long, value_name = "NAME", conflicts_with = "scene")]
    pub builtin: Option<String>,

    /// Length of one unit of the scene file, metres, for formats without a fixed unit (OBJ, C arrays) [default: 1]
    #[arg(long, value_name = "METRES", value_parser = positive, conflicts_with = "builtin")]
    pub unit: Option<f64>,

    /// Add an object to the scene: X,Y,Z is the middle of its underside in metres, SCALE a factor on its size, TURN an angle about +Y in
    /// degrees. FILE may be builtin:NAME. Its lights and cameras are left out. May be given more than once
    #[arg(long, value_name = "FILE@X,Y,Z[,SCALE[,TURN]]")]
    pub add: Vec<Added>,

    /// Change the albedo of a material of the scene: linear red, green and blue from 0 to 1, or one number for a grey. May be given more than
    /// once
    #[arg(long, value_name = "MATERIAL.albedo=R,G,B")]
    pub set: Vec<Change>,

    /// Land from a height map: a picture whose values are heights. WIDTH of the longer edge, HEIGHT of the value 1, largest ERROR, and place of the
    /// middle, metres [default: 1 m a pixel, a tenth of WIDTH (1 m for .exr, .pfm and .hdr), a thousandth of the difference in height, 0,0,0]
    #[arg(long, value_name = "FILE[@WIDTH[,HEIGHT[,ERROR[,X,Y,Z]]]]", conflicts_with = "ground")]
    pub terrain: Option<Terrain>,

    #[command(flatten)]
    pub ground: GroundArgs,
}

impl SceneArgs {
    /// Reads the scene with the added objects.
    ///
    /// # Errors
    /// As [`Self::open_alone`] and [`Self::add`].
    pub fn open(&self) -> Result<(Scene, Source)> {
        let (mut scene, source) = self.open_alone()?;
        self.add(&mut scene)?;
        Ok((scene, source))
    }

    /// Reads the scene without the added objects.
    ///
    /// # Errors
    /// As [`open`], [`Terrain::add`] and [`GroundArgs::place`].
    pub fn open_alone(&self) -> Result<(Scene, Source)> {
        let (mut scene, source) = match (&self.terrain, &self.scene, &self.builtin) {
            // Land without anything on it.
            (Some(terrain), None, None) => {
                let name = terrain.file().file_stem().map(|stem| stem.to_string_lossy().into_owned());
                (Scene { name: name.unwrap_or_default(), ..Scene::default() }, Source::Terrain)
            }
            (_, file, name) => open(file.as_deref(), name.as_deref(), &in_unit(self.unit))?,
        };
        if let Some(terrain) = &self.terrain {
            terrain.add(&mut scene)?;
        }
        changed::all(&mut scene, &self.set)?;
        Ok((self.ground.place(scene, self.unit)?, source))
    }

    /// Whether the options name a scene.
    pub fn is_named(&self) -> bool {
        self.scene.is_some() || self.builtin.is_some() || self.terrain.is_some()
    }

    /// Adds the objects.
    ///
    /// # Errors
    /// As [`added::all`].
    pub fn add(&self, scene: &mut Scene) -> Result<()> {
        added::all(scene, &self.add, &in_unit(self.unit))
    }
}

/// Options for reading a scene whose unit is `unit` metres.
pub fn in_unit(unit: Option<f64>) -> LoadOptions {
    LoadOptions { unit: unit.map(|metres| metres as f32), ..LoadOptions::default() }
}

/// Whether `path` names a built-in environment and not a file.
pub fn is_built_in_environment(path: &Path) -> bool {
    path.to_str().is_some_and(|name| builtin::ENVIRONMENTS.contains(&name)) && !path.is_file()
}

/// Reads an environment, or makes a built-in one. A square picture is taken as a light probe (an angular map).
///
/// # Errors
/// `Input` if the file cannot be read or is not supported.
pub fn environment(path: &Path) -> Result<(Environment, Vec<Note>)> {
    match path.to_str() {
        Some(name) if is_built_in_environment(path) => Ok((builtin::environment(name)?, Vec::new())),
        _ if path.is_dir() => environment::load(path, &Limits::default()),
        _ => {
            // The latitude-longitude picture is twice as large as the probe, and both are in memory at the same time.
            let limits = Limits::default();
            let limits = Limits { max_alloc: limits.max_alloc / 4, ..limits };
            let picture = image::read(path, &limits).map_err(|error| like_built_in(error, path))?;
            let name = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
            let plain = !picture.metadata.extra.contains_key("envmap");
            let unfolded = plain.then(|| image::from_angular_map(&picture)).flatten();
            let found = environment::from_picture(unfolded.as_ref().unwrap_or(&picture), name, &Limits::default());
            found.map_err(|error| error.in_file(path))
        }
    }
}

/// Names the built-in environment that is most like a file that does not exist.
fn like_built_in(error: Error, path: &Path) -> Error {
    let asked = path.to_str().filter(|_| !path.exists());
    match asked.and_then(|asked| nearest(asked, builtin::ENVIRONMENTS.iter().copied())) {
        Some(name) => {
            error.help(format!("Did you mean {name:?}? Built-in environments: {}", builtin::ENVIRONMENTS.join(", ")))
        }
        None => error,
    }
}

/// Reads a file or makes a built-in scene.
///
/// # Errors
/// `Input` if the file cannot be read or is not supported, `Usage` if there is no such built-in scene.
pub fn open(file: Option<&Path>, name: Option<&str>, options: &LoadOptions) -> Result<(Scene, Source)> {
    match (file, name) {
        (Some(path), _) => {
            let scene = scene::load(path, options)?;
            Ok((scene, Source::File(path.to_string_lossy().into_owned())))
        }
        (None, Some(name)) => Ok((builtin::load(name)?, Source::Builtin(name.to_owned()))),
        (None, None) => Err(Error::usage("no scene was given").help("Give a file, or a built-in scene with --builtin")),
    }
}
