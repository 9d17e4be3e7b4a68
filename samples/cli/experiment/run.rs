//! Renders the missing pictures of an experiment.

use std::{
    collections::BTreeMap,
    time::{Duration, Instant},
};

use lucerna::{
    Error, ErrorKind, Result,
    bake::Shard,
    gpu::Gpu,
    image::{Layer, Layers, Metadata},
};
use serde_json::json;

use super::{
    cache::{self, Cache, Inputs, Key},
    file::{Changes, Experiment, IfMissing, Method, Scene},
    kinds::{self, Job, Kind, Warm},
    place::{self, Folders, Loaded},
    progress::Progress,
    results::{Done, Results, Shining, label},
};
use crate::{config, console::Console, program, progress::ProgressMode, signals::Interrupt};

/// A picture to render.
#[derive(Clone, Debug)]
struct Step {
    /// Index into the scene's views.
    view: usize,
    method: usize,
    variant: Changes,
}

/// Options of this run of the program, which do not belong to the experiment.
#[derive(Debug)]
pub struct Context<'a> {
    pub gpu: &'a Gpu,
    pub folders: Folders,
    pub cache: &'a Cache,
    pub console: Console,
    pub progress: ProgressMode,
    pub interrupt: &'a Interrupt,
    /// The command line, for the report.
    pub command: String,
    /// Renders only the runs of this part.
    pub shard: Option<Shard>,
    /// Starts no run that would end later.
    pub until: Option<Instant>,
    /// Lists the pictures without rendering them.
    pub dry: bool,
}

/// A planned run, and whether its picture exists.
#[derive(Clone, Debug)]
pub struct Planned {
    pub done: Done,
    pub there: bool,
}

/// Why pictures are missing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stopped {
    /// A signal.
    Request,
    TimeLimit,
}

impl std::fmt::Display for Stopped {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Request => "stopped",
            Self::TimeLimit => "time limit: stopped",
        })
    }
}

/// The result of a run.
#[derive(Debug)]
pub struct Rendered {
    pub results: Results,
    pub planned: Vec<Planned>,
    pub stopped: Option<Stopped>,
}

/// Renders all missing pictures of the shard, scene after scene. With `dry` it renders none.
///
/// # Errors
/// `Input` for scenes that cannot be read; any error of rendering.
pub fn run(experiment: Experiment, context: &Context<'_>) -> Result<Rendered> {
    let Context { gpu, cache: kept, console, .. } = context;
    let mut skipped = Vec::new();
    let needs = available(&experiment, &mut skipped)?;
    // All scenes are read first, so that missing files are reported at once and the amount of work is known.
    let mut steps: Vec<(&Scene, Vec<Step>)> = Vec::new();
    let mut first = None;
    for entry in &experiment.scenes {
        let Some(loaded) = place::load(&experiment, entry, &context.folders)? else {
            let files: Vec<String> = entry.files().filter(|name| context.folders.find(name).is_none()).collect();
            let file = files.join(", ");
            console.warning(&format!("scene '{}' is skipped: {file} does not exist", entry.name));
            skipped.push((format!("scene {}", entry.name), format!("a file does not exist: {file}")));
            continue;
        };
        let list = of_scene(&experiment, entry, &loaded, &needs);
        steps.push((entry, list));
        // Keeps the first scene, because it is probably rendered next.
        first.get_or_insert((entry.name.clone(), loaded));
    }
    let all: usize = steps.iter().map(|(_, list)| list.len()).sum();
    if all == 0 {
        return Err(Error::input("there is no picture to render").help("Scenes or programs were skipped; see above"));
    }
    if let Some(shard) = context.shard {
        let (mine, mut index) = (shard.range(all as u64), 0..);
        steps.iter_mut().for_each(|(_, list)| list.retain(|_| index.next().is_some_and(|at| mine.contains(&at))));
        steps.retain(|(_, list)| !list.is_empty());
    }
    let mut counts = BTreeMap::<String, usize>::new();
    for step in steps.iter().flat_map(|(_, list)| list) {
        *counts.entry(experiment.methods[step.method].name.clone()).or_default() += 1;
    }
    let total: usize = counts.values().sum();
    let part = context.shard.map(|shard| format!(" of {all}, shard {shard}")).unwrap_or_default();
    console.info(&format!(
        "{}: {total} runs{part}, {} scenes, {} on {}",
        experiment.name,
        steps.len(),
        experiment.size,
        gpu.describe()
    ));
    let device = cache::device(gpu);
    let mut progress = Progress::new(context.progress, console.is_quiet() || context.dry, counts);
    let (mut planned, mut failed, mut stopped) = (Vec::new(), 0, None);
    'all: for (entry, list) in &steps {
        let loaded = match first.take().filter(|(name, _)| *name == entry.name) {
            Some((_, loaded)) => loaded,
            None => match place::load(&experiment, entry, &context.folders)? {
                Some(loaded) => loaded,
                None => {
                    return Err(
                        Error::input("was removed while the experiment ran").at(format!("scene '{}'", entry.name))
                    );
                }
            },
        };
        let mut warm = Warm::new(gpu, &loaded, kept.shared());
        for step in list {
            if context.interrupt.requested() {
                stopped = Some(Stopped::Request);
                break 'all;
            }
            let method = &experiment.methods[step.method];
            let one = One { experiment: &experiment, entry, loaded: &loaded, method, step, needs: &needs[step.method] };
            let (done, key) = one.describe(&device)?;
            let what = format!("{}/{} {}", done.scene, done.view, done.label());
            let mut there = kept.times(&done.key).is_some();
            let begun = Instant::now();
            let mut seconds = None;
            if !there && !context.dry {
                let spent = Duration::from_secs_f64(progress.slowest(&method.name));
                if context.until.is_some_and(|until| Instant::now() + spent >= until) {
                    stopped = Some(Stopped::TimeLimit);
                    break 'all;
                }
                match one.render(&mut warm, context, &key) {
                    Ok(true) => {
                        there = true;
                        seconds = Some(begun.elapsed().as_secs_f64());
                    }
                    Ok(false) => {
                        stopped = Some(Stopped::Request);
                        break 'all;
                    }
                    Err(error) if context.interrupt.requested() && program::by_request(&error) => {
                        stopped = Some(Stopped::Request);
                        break 'all;
                    }
                    // A failed picture of an optional program must not end an experiment that takes hours.
                    Err(error) if method.if_missing == IfMissing::Skip && error.kind() != ErrorKind::DeviceLost => {
                        console.warning(&format!("{what} is skipped: {error}"));
                        skipped.push((what.clone(), error.to_string()));
                        failed += 1;
                    }
                    Err(error) => return Err(error.at(&what)),
                }
            }
            progress.run(&method.name, &what, seconds);
            planned.push(Planned { done, there });
        }
    }
    drop(progress);
    let runs: Vec<Done> = planned.iter().filter(|run| run.there).map(|run| run.done.clone()).collect();
    let missing = total - runs.len() - failed;
    let facts = facts(&experiment, context);
    let results = Results { experiment, runs, skipped, missing, facts, cache: (*kept).clone() };
    Ok(Rendered { results, planned, stopped })
}

/// Versions of the programs that methods need; `None` if a program is missing and its method may be skipped.
fn available(experiment: &Experiment, skipped: &mut Vec<(String, String)>) -> Result<Vec<Option<String>>> {
    let mut list = Vec::new();
    for method in &experiment.methods {
        let kind = kinds::find(&method.kind)?;
        list.push(match ((kind.available)(), method.if_missing) {
            (Ok(version), _) => Some(version),
            (Err(why), IfMissing::Skip) => {
                skipped.push((method.name.clone(), why));
                None
            }
            (Err(why), IfMissing::Fail) => {
                return Err(Error::input(why).at(format!("line {}: '{}'", method.line, method.name)));
            }
        });
    }
    Ok(list)
}

/// The runs of a scene, view after view, so that an interrupted experiment has complete views.
fn of_scene(experiment: &Experiment, entry: &Scene, loaded: &Loaded, needs: &[Option<String>]) -> Vec<Step> {
    let indices: Vec<usize> = (0..loaded.views.len()).collect();
    let mut steps = Vec::new();
    for &view in &indices {
        for (index, method) in experiment.methods.iter().enumerate() {
            let chosen = place::spread(&indices, method.most_views).contains(&&view);
            if chosen && method.takes(&entry.name) && needs[index].is_some() {
                steps.extend(method.variants().into_iter().map(|variant| Step { view, method: index, variant }));
            }
        }
    }
    steps
}

struct One<'a> {
    experiment: &'a Experiment,
    entry: &'a Scene,
    loaded: &'a Loaded,
    method: &'a Method,
    step: &'a Step,
    needs: &'a Option<String>,
}

impl One<'_> {
    fn view(&self) -> &place::View {
        &self.loaded.views[self.step.view]
    }

    fn kind(&self) -> Result<&'static Kind> {
        kinds::find(&self.method.kind)
    }

    fn describe(&self, device: &str) -> Result<(Done, Key)> {
        let Self { experiment, entry, loaded, method, step, .. } = self;
        let view = self.view().at(&loaded.pose, experiment.size);
        let inputs = Inputs {
            scene: loaded.fingerprint.clone(),
            view: place::view_key(&view)?,
            settings: self.kind()?.effective(method, &step.variant)?,
            seed: experiment.seed,
            repeat: method.repeat,
            layers: method.layers.clone(),
        };
        let key = Key::new(self.kind()?, device, self.needs.as_deref().unwrap_or_default(), &inputs)?;
        let done = Done {
            scene: entry.name.clone(),
            group: entry.group.clone(),
            triangles: loaded.triangles,
            shining: loaded.image.is_none().then(|| Shining::of(&loaded.scene)),
            view: self.view().name.clone(),
            method: method.name.clone(),
            variant: step.variant.clone(),
            key: key.name.clone(),
            exposure: loaded.exposure,
        };
        Ok((done, key))
    }

    /// Renders and stores the picture. Returns false if it was interrupted.
    fn render(&self, warm: &mut Warm<'_>, context: &Context<'_>, key: &Key) -> Result<bool> {
        let Self { experiment, entry, loaded, method, step, .. } = self;
        let view = self.view().at(&loaded.pose, experiment.size);
        let settings = self.kind()?.effective(method, &step.variant)?;
        let job = Job {
            view: &view,
            settings: &settings,
            seed: experiment.seed,
            repeat: method.repeat,
            interrupt: context.interrupt,
        };
        let Some(rendered) = (self.kind()?.render)(warm, &job)? else { return Ok(false) };
        if context.interrupt.requested() {
            return Ok(false);
        }
        let about = context.gpu.describe();
        let kept = |layer: &Layer| layer.name.is_empty() || method.layers.contains(&layer.name);
        let layers = Layers {
            layers: rendered.layers.layers.into_iter().filter(kept).collect(),
            metadata: Metadata {
                program: "lucerna reproduce".into(),
                version: program::VERSION.into(),
                scene: entry.name.clone(),
                scene_hash: loaded.fingerprint.clone(),
                camera: self.view().name.clone(),
                technique: label(&method.name, &step.variant),
                seed: experiment.seed.into(),
                device: about.device.clone(),
                driver: format!("{} {}", about.driver, about.driver_info).trim().to_owned(),
                shader_compiler: lucerna::shaders::COMPILER.to_owned(),
                config: json!({ "kind": method.kind, "settings": settings }),
                world_to_camera: Some(view.view_from_world.to_cols_array()),
                world_to_ndc: Some(view.clip_from_world.to_cols_array()),
                ..Metadata::default()
            },
            ..rendered.layers
        };
        context.cache.put(key, &layers, &rendered.times)?;
        context.interrupt.keep();
        Ok(true)
    }
}

fn facts(experiment: &Experiment, context: &Context<'_>) -> Vec<(String, String)> {
    let about = context.gpu.describe();
    let facts = [
        ("Command", context.command.clone()),
        ("Program", format!("lucerna {}", program::VERSION)),
        ("Revision", program::revision().unwrap_or("unknown").to_owned()),
        ("Device", format!("{} ({})", about.device, about.kind)),
        ("Driver", format!("{} {}", about.driver, about.driver_info).trim().to_owned()),
        ("Vulkan", about.api_version.clone()),
        ("Size", format!("{} pixels", experiment.size)),
        ("Seed", experiment.seed.to_string()),
        ("Mode", if experiment.quick { "quick".into() } else { "full".into() }),
    ];
    let mut facts: Vec<(String, String)> = facts.map(|(name, value)| (name.to_owned(), value)).to_vec();
    if !experiment.narrowed.is_empty() {
        facts.push(("Part".into(), experiment.narrowed.to_string()));
    }
    for method in &experiment.methods {
        let mut changes = config::to_value(&method.settings).unwrap_or_default().to_string();
        if method.paper {
            changes = format!("the paper's choices; {changes}");
        }
        let matrix: Vec<String> =
            method.matrix.iter().map(|(key, values)| format!("; {key} = {}", json!(values))).collect();
        facts.push((format!("Settings of {}", method.name), format!("{}: {changes}{}", method.kind, matrix.concat())));
    }
    facts
}

#[cfg(test)]
#[path = "run_tests.rs"]
mod tests;
