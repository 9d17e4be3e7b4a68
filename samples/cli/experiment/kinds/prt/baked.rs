//! Bakes that stay in memory, and in the folder of the report.

use std::{path::Path, time::Instant};

use lucerna::{
    Error, ErrorKind, Result, Stop,
    bake::{self, End, Options, Store},
    gpu::Gpu,
    graph::Runner,
    image,
    scene::{Pose, Scene},
    technique::{Ready, Shot, Technique},
    techniques::prt::{Baked, Bakery, Baking, Mode, PictureSettings, Prt, Stored, Summary, units},
};
use serde::{Deserialize, Serialize};
use serde_json::json;

use super::{Cut, Job, Rendered, Warm, on_device};
use crate::{
    config,
    experiment::{cache, digest::Digest, sealed},
    fingerprint,
    signals::Interrupt,
};

/// Bakes of a scene that stay in memory; the others are read again.
const KEPT: usize = 2;
/// Largest file of a bake, bytes.
const MOST_BYTES: u64 = 8 << 30;

/// A bake, and what is ready for its last picture.
pub(super) struct Kept {
    by: Baking,
    stored: Stored,
    /// Times of the stages.
    seconds: Vec<(String, f64)>,
    ready: Option<Prepared>,
}

/// What is on the device for some vectors of a bake.
struct Prepared {
    by: (Cut, PictureSettings),
    ready: Ready<Prt>,
    runner: Runner,
    facts: Vec<(String, f64)>,
}

/// The contents of the text file next to a bake.
#[derive(Serialize, Deserialize)]
struct Made {
    /// Digest of the file of the bake.
    bake: String,
    /// Time of each stage.
    seconds: Vec<(String, f64)>,
}

/// The bake for these settings; `None` if it was interrupted.
pub(super) fn of<'w>(warm: &'w mut Warm<'_>, baking: &Baking) -> Result<Option<&'w mut Kept>> {
    let (gpu, scene, folder) = (warm.gpu, warm.scene, warm.folder.clone());
    let list: &mut Vec<Kept> = warm.keep("prt bakes", |_, _, _| Ok(Vec::new()))?;
    let index = match list.iter().position(|kept| kept.by == *baking) {
        Some(index) => index,
        None => {
            list.truncate(KEPT - 1);
            let Some((stored, seconds)) = find(gpu, scene, baking, &folder, &Interrupt::stop())? else {
                return Ok(None);
            };
            list.insert(0, Kept { by: baking.clone(), stored, seconds, ready: None });
            0
        }
    };
    Ok(list.get_mut(index))
}

type Found = (Stored, Vec<(String, f64)>);

/// Reads the bake, or makes and writes it.
fn find(gpu: &Gpu, scene: &Scene, baking: &Baking, folder: &Path, stop: &Stop) -> Result<Option<Found>> {
    let text = json!([cache::SOURCES, cache::device(gpu), fingerprint::scene(scene), config::to_value(baking)?]);
    let name = Digest::of(text.to_string().as_bytes()).hex();
    let (file, about) = (folder.join(format!("{name}.prt")), folder.join(format!("{name}.json")));
    let known = known(&file, &about).unwrap_or_else(|error| {
        cache::does_not_count(&error);
        None
    });
    if known.is_some() {
        return Ok(known);
    }
    std::fs::create_dir_all(folder)
        .map_err(|error| Error::new(ErrorKind::Output, "cannot be made").in_file(folder).caused_by(error))?;
    let made = match make(gpu, scene, baking, folder, stop) {
        Err(error) if error.kind() == ErrorKind::Interrupted => None,
        made => made?,
    };
    let Some((stored, seconds)) = made else { return Ok(None) };
    let bytes = stored.encode()?;
    sealed::refuse_link(&file)?;
    image::write_atomic(&file, &bytes, true)?;
    sealed::write(&about, &Made { bake: Digest::of(&bytes).hex(), seconds: seconds.clone() })?;
    Ok(Some((stored, seconds)))
}

/// The stored bake; `None` if there is none.
///
/// # Errors
/// `Input`, naming the file, if it is damaged or was replaced.
fn known(file: &Path, about: &Path) -> Result<Option<Found>> {
    let Some(Made { bake, seconds }) = sealed::read(about)? else { return Ok(None) };
    let bytes = image::read_file_checked(file, MOST_BYTES)?;
    if Digest::of(&bytes).hex() != bake {
        return Err(Error::input("does not hold the stored bake: it is damaged or was replaced").in_file(file));
    }
    let stored = Stored::decode(&bytes).map_err(|error| error.in_file(file))?;
    Ok(Some((stored, seconds)))
}

/// Bakes. A stopped bake begins anew, so that the times of its stages are whole.
fn make(gpu: &Gpu, scene: &Scene, baking: &Baking, folder: &Path, stop: &Stop) -> Result<Option<Found>> {
    let begun = Instant::now();
    let mut bakery = Bakery::new(gpu, scene)?;
    let starts = bakery.starts(baking, stop)?.points;
    let sampled = bakery.sample(baking, &starts, stop)?;
    let of_samples = begun.elapsed().as_secs_f64();
    let temporary = tempfile::tempdir_in(folder).map_err(|error| {
        Error::new(ErrorKind::Output, "no folder can be made in it").in_file(folder).caused_by(error)
    })?;
    let samples = sampled.samples.clone();
    let store = Store::create(temporary.path(), units::job(&sampled.plan, &samples, &cache::device(gpu))?)?;
    let mut work = units::Work::new(bakery, sampled)?;
    let options = Options { stop: stop.clone(), ..Options::default() };
    let one = |unit: bake::UnitId, needed: bake::Needed<'_>| work.unit(unit, &needed);
    if bake::run(&store, &options, one, |_| {})?.end != End::Done {
        return Ok(None);
    }
    let stored = Stored::join(&store, samples)?;
    let whole = begun.elapsed().as_secs_f64();
    let mut seconds = vec![("seconds samples".to_owned(), of_samples)];
    // The samples are there before all stages; their unit only keeps them.
    let stages = work.seconds().filter(|(name, _)| *name != "samples");
    seconds.extend(stages.map(|(name, spent)| (format!("seconds {name}"), spent)));
    seconds.push(("seconds whole".into(), whole));
    Ok(Some((stored, seconds)))
}

impl Kept {
    /// A picture by some of the vectors.
    pub(super) fn render(
        &mut self,
        gpu: &Gpu,
        (scene, cut): (&Scene, &Cut),
        job: &Job<'_>,
        shot: Shot<Mode>,
        settings: &PictureSettings,
    ) -> Result<Option<Rendered>> {
        let by = (cut.clone(), Prt::prepared_by(settings));
        if self.ready.as_ref().is_none_or(|ready| ready.by != by) {
            self.ready = None;
            let stored = cut.of(&self.stored);
            let mut facts = facts(&stored.summary(), *cut == Cut::default());
            facts.push(("vectors".into(), stored.plan.all_vectors() as f64));
            let begun = Instant::now();
            let ready = Ready::new(gpu, scene, settings, Some(&Baked::new(stored)), &mut |_, _| true)?;
            facts.push(("seconds ready".into(), begun.elapsed().as_secs_f64()));
            self.ready = Some(Prepared { by, ready, runner: Runner::new(gpu), facts });
        }
        let Some(Prepared { ready, runner, facts, .. }) = &mut self.ready else { return Ok(None) };
        let pose = Pose::rest(scene);
        let rendered =
            on_device(runner, job, "prt", |graph| ready.frame(graph, (scene, &pose), job.view, shot, settings))?;
        Ok(rendered.map(|mut rendered| {
            rendered.times.facts.extend(facts.iter().chain(&self.seconds).cloned());
            rendered
        }))
    }
}

/// Sizes of a bake; with `whole` also the errors, which are not known for a part of the vectors.
fn facts(summary: &Summary, whole: bool) -> Vec<(String, f64)> {
    let sizes = [
        ("samples", summary.samples as f64),
        ("clusters", summary.clusters as f64),
        ("area", summary.area),
        ("radius", f64::from(summary.radius)),
        ("bytes samples", summary.sample_bytes as f64),
        ("bytes visibility", summary.visibility_bytes as f64),
        ("bytes visibility vectors", summary.visibility_vectors_bytes as f64),
        ("bytes basis", summary.basis_bytes as f64),
        ("bytes transfer", summary.transfer_bytes as f64),
        ("bytes links", summary.link_bytes as f64),
        ("bytes directions", summary.directional_bytes as f64),
        ("kept", summary.kept),
    ];
    let errors = [("distance error", summary.distance_error), ("left", summary.left)];
    let all = sizes.iter().chain(if whole { &errors[..] } else { &[] });
    all.map(|(name, value)| ((*name).to_owned(), *value)).collect()
}
