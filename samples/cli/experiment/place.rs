//! Scenes of an experiment with their views.

use std::path::{Path, PathBuf};

use glam::{Mat4, Vec3};
use lucerna::{
    Error, ErrorKind, Result,
    image::{self, Layers},
    scene::{self, Camera, Limits, Pose, Projection, extent::Extents},
};
use lucerna_scenes as builtin;

use super::file::{Experiment, IfMissing, Scene as Entry};
use crate::{
    args::Size,
    camera::{self, CameraFile, Choice},
    config, fingerprint, framing, lights,
    placed::Placed,
    source,
    views::{self, ViewList},
};

/// The folders in which relative file names are searched.
#[derive(Clone, Debug)]
pub struct Folders(Vec<PathBuf>);

impl Folders {
    /// The folder of the experiment's file; `assets` or, without it, `$LUCERNA_ASSETS` or `../shared/assets`; and the current folder.
    pub fn new(experiment: &Experiment, assets: Option<&Path>) -> Self {
        let beside = experiment.path.as_ref().and_then(|path| path.parent()).map(Path::to_path_buf);
        let assets = assets.map(Path::to_path_buf).or_else(|| std::env::var_os("LUCERNA_ASSETS").map(PathBuf::from));
        let assets = assets.unwrap_or_else(|| PathBuf::from("../shared/assets"));
        Self(beside.into_iter().chain([assets, PathBuf::from(".")]).collect())
    }

    /// The first existing file of this name.
    pub fn find(&self, name: &str) -> Option<PathBuf> {
        self.0.iter().map(|folder| folder.join(name)).find(|path| path.is_file())
    }

    fn missing(&self, name: &str) -> Error {
        let places: Vec<String> = self.0.iter().map(|folder| folder.display().to_string()).collect();
        Error::input(format!("no file '{name}' in {}", places.join(", ")))
            .help("Give the folder with --assets DIR, or allow to skip the scene with if_missing = \"skip\"")
    }
}

/// A view of a scene.
#[derive(Clone, Debug)]
pub struct View {
    pub name: String,
    /// Size that replaces the experiment's size.
    size: Option<Size>,
    placed: Placed,
}

impl View {
    fn new(placed: Placed) -> Self {
        Self { name: placed.name.clone(), size: None, placed }
    }

    fn from_file(name: &str, file: &CameraFile) -> Self {
        Self::new(Placed::from_file(name.to_owned(), file))
    }

    /// The view of an entry that is a picture.
    fn still(image: &Layers) -> Self {
        let projection = Projection::Orthographic { xmag: 1.0, ymag: 1.0, znear: 0.0, zfar: 1.0 };
        let placed = Placed::fixed(Camera { name: STILL.into(), projection }, Mat4::IDENTITY);
        Self { size: Some(Size { width: image.width, height: image.height }), ..Self::new(placed) }
    }

    /// The view in a pose, at its own size or else at `size`.
    pub fn at(&self, pose: &Pose, size: Size) -> scene::View {
        self.placed.view(pose, self.size.unwrap_or(size))
    }
}

/// A scene in memory.
#[derive(Debug)]
pub struct Loaded {
    /// Empty if it is a picture.
    pub scene: scene::Scene,
    pub pose: Pose,
    pub image: Option<Layers>,
    pub fingerprint: String,
    pub triangles: usize,
    pub views: Vec<View>,
    /// A fitting exposure, EV, if known.
    pub exposure: Option<f64>,
}

/// Reads a scene and makes its views; `None` if a file is missing and the scene may be skipped.
///
/// # Errors
/// `Input`, naming the experiment's file and the line of the scene.
pub fn load(experiment: &Experiment, entry: &Entry, folders: &Folders) -> Result<Option<Loaded>> {
    let named = |error: Error| {
        let file = experiment.path.clone().unwrap_or_else(|| PathBuf::from(format!("{}.toml", experiment.name)));
        let place = format!("line {}: scene '{}'", entry.line, entry.name);
        // The text of the error names the other file.
        match error.file() {
            Some(_) => Error::new(error.kind(), error.to_string()).at(place).in_file(file),
            None => error.at(place).in_file(file),
        }
    };
    if let Some(name) = entry.files().find(|name| folders.find(name).is_none()) {
        return match entry.if_missing {
            IfMissing::Skip => Ok(None),
            IfMissing::Fail => Err(named(folders.missing(&name))),
        };
    }
    read(experiment, entry, folders).map(Some).map_err(named)
}

fn read(experiment: &Experiment, entry: &Entry, folders: &Folders) -> Result<Loaded> {
    let found = |name: &String| folders.find(name).ok_or_else(|| folders.missing(name));
    if let Some(name) = &entry.image {
        return still(&found(name)?, entry);
    }
    let path = entry.file.as_ref().map(found).transpose()?;
    let (mut scene, _) = source::open(path.as_deref(), entry.builtin.as_deref(), &source::in_unit(entry.unit))?;
    if let Some(ground) = &entry.ground {
        scene = ground.place(scene, entry.unit, |path| found(&path.to_string_lossy().into_owned()))?;
    }
    scene.name.clone_from(&entry.name);
    if let Some(name) = &entry.environment {
        let path = Path::new(name);
        let path = if source::is_built_in_environment(path) { path.to_path_buf() } else { found(name)? };
        scene.environment = Some(source::environment(&path)?.0);
    }
    if !entry.lights {
        scene.nodes.iter_mut().for_each(|node| node.light = None);
    }
    if !entry.emission {
        scene.materials.iter_mut().for_each(|material| material.emissive = Vec3::ZERO);
    }
    lights::light(&mut scene, &entry.light, entry.sun.as_ref(), entry.default_light);
    if !entry.sky {
        scene.environment = None;
    }
    if !entry.cameras.is_empty() {
        framing::add_missing_camera(&mut scene, experiment.size.aspect());
    }
    let pose = Pose::playing(&scene, 0.0);
    Extents::of(&scene).check(&scene, &pose)?;
    let views = sized(all_views(entry, &scene, &pose, folders)?, entry)?;
    // As drawn: a mesh counts once for each node that shows it.
    let drawn = scene.nodes.iter().filter_map(|node| scene.meshes.get(node.mesh? as usize));
    let triangles = drawn.flat_map(|mesh| &mesh.primitives).map(|primitive| primitive.indices.len() / 3).sum();
    let exposure = entry.exposure.or_else(|| entry.builtin.as_deref().and_then(builtin::exposure).map(f64::from));
    Ok(Loaded { fingerprint: fingerprint::scene(&scene), scene, pose, image: None, triangles, views, exposure })
}

/// Name of the only view of a picture.
const STILL: &str = "still";

fn still(path: &Path, entry: &Entry) -> Result<Loaded> {
    let image = image::read(path, &Limits::default())?;
    let scene = scene::Scene { name: entry.name.clone(), ..Default::default() };
    Ok(Loaded {
        fingerprint: fingerprint::image(&image),
        pose: Pose::rest(&scene),
        scene,
        triangles: 0,
        views: vec![View::still(&image)],
        exposure: entry.exposure,
        image: Some(image),
    })
}

/// Maximum of views per scene.
const MOST_VIEWS: usize = 100_000;

/// Every view at every size.
fn sized(views: Vec<View>, entry: &Entry) -> Result<Vec<View>> {
    if entry.sizes.is_empty() {
        return Ok(views);
    }
    let sizes: Vec<Size> = entry.sizes.iter().map(|size| size.parse().map_err(Error::input)).collect::<Result<_>>()?;
    let all = views.len().saturating_mul(sizes.len());
    if all > MOST_VIEWS {
        let what = format!("{} views at {} sizes are {all}; at most {MOST_VIEWS} are made", views.len(), sizes.len());
        return Err(Error::input(what));
    }
    let at = |view: &View, size: Size| View { name: format!("{} {size}", view.name), size: Some(size), ..view.clone() };
    Ok(views.iter().flat_map(|view| sizes.iter().map(move |&size| at(view, size))).collect())
}

fn all_views(entry: &Entry, scene: &scene::Scene, pose: &Pose, folders: &Folders) -> Result<Vec<View>> {
    let mut list: Vec<View> = Vec::new();
    let found = |name: &str| folders.find(name).ok_or_else(|| folders.missing(name));
    for asked in &entry.cameras {
        list.push(match camera::in_list(asked) {
            Some((file, view)) => {
                let views = ViewList::read(&found(file)?)?;
                let view = views.find(view)?;
                View::from_file(&view.name, &view.camera())
            }
            None => one(asked, scene, folders)?,
        });
    }
    if let Some(name) = &entry.list {
        let views = ViewList::read(&found(name)?)?;
        list.extend(views.views.iter().map(|view| View::from_file(&view.name, &view.camera())));
    }
    if entry.recorded {
        list.extend(views::recorded(scene, pose).iter().map(|v| View::from_file(&v.name, &v.camera())));
    }
    if entry.random > 0 {
        let judge = views::draw::Judge::new(scene, pose)?;
        let judge = if entry.dark_views { judge.without_lights() } else { judge };
        let drawn = judge.views(&entry.name, entry.random, entry.seed)?;
        list.extend(drawn.iter().map(|view| View::from_file(&view.name, &view.camera())));
    }
    if let Some(twice) = list.iter().enumerate().find(|(i, view)| list[..*i].iter().any(|v| v.name == view.name)) {
        return Err(Error::input(format!("two views are named '{}'", twice.1.name)));
    }
    if list.is_empty() {
        return Err(Error::new(ErrorKind::Input, "there are no views"));
    }
    Ok(spread(&list, entry.most_views).into_iter().cloned().collect())
}

/// One camera by index, name or file.
fn one(asked: &str, scene: &scene::Scene, folders: &Folders) -> Result<View> {
    if asked.ends_with(".toml") {
        let path = folders.find(asked).ok_or_else(|| folders.missing(asked))?;
        let name = path.file_stem().map_or_else(|| "camera".into(), |stem| stem.to_string_lossy().into_owned());
        return Ok(View::from_file(&name, &CameraFile::read(&path)?));
    }
    let names: Vec<&str> = scene.cameras.iter().map(|camera| camera.name.as_str()).collect();
    Ok(match camera::choose(asked, &names)? {
        Choice::Scene(index) => View::new(Placed::of_scene(scene, index)),
        Choice::File(file) => View::from_file(asked, &file),
    })
}

/// At most `most` elements of a list, evenly spread, including the first.
pub fn spread<T>(list: &[T], most: Option<usize>) -> Vec<&T> {
    match most {
        Some(most) if most < list.len() => (0..most).map(|i| &list[i * list.len() / most]).collect(),
        _ => list.iter().collect(),
    }
}

/// All data of a view that can change a picture.
pub fn view_key(view: &scene::View) -> Result<serde_json::Value> {
    let camera = [view.view_from_world, view.clip_from_view].map(|m| m.to_cols_array().to_vec());
    config::to_value(&(camera, view.extent))
}

#[cfg(test)]
mod tests {
    #[test]
    fn few_views_are_spread_over_all() {
        let list: Vec<usize> = (0..10).collect();
        assert_eq!(super::spread(&list, Some(4)), [&0, &2, &5, &7]);
        assert_eq!(super::spread(&list, Some(1)), [&0]);
        assert_eq!(super::spread(&list, Some(99)).len(), 10);
        assert_eq!(super::spread(&list, None).len(), 10);
    }
}
