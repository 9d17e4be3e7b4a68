//! The state of one run of `render`: its options, its finished frames, and its report.

use std::{ops::Range, path::Path, time::Duration};

use lucerna::{
    Error, ErrorKind, Result,
    gpu::{DeviceKind, Gpu},
    graph::Report,
    image::{self, Format, Layers, Metadata, WriteOptions},
    passes::temporal,
    scene::{Note, NoteKind, Pose, View},
    techniques::tonemap::Operator,
};
use serde::Serialize;
use serde_json::{Value, json};

use crate::{
    args::{Frames, RenderArgs},
    config,
    console::{self, Console},
    exposure,
    last_stage::Staged,
    outputs::{ALPHA_LEFT_OUT, Fresh, Outputs},
    pattern::Values,
    program,
    record::{BakeFile, Record},
    relight::{self, Dark},
    render::Label,
    smooth::{self, Aa, Smooth, SmoothArgs},
    stage::Stage,
    timings::Timings,
};

/// A running `render`.
#[derive(Debug)]
pub struct Run<'a> {
    args: &'a RenderArgs,
    console: Console,
    /// Technique and mode in file names: `isr`, or `isr-direct` with a mode.
    label: String,
    /// The exposure is chosen by the first frame.
    fit_exposure: bool,
    /// Anti-aliasing; that of the device after [`Self::smooth_on`].
    pub smooth: Smooth,
    /// Whether a CPU driver takes the mean of several pictures unasked, as GPUs do, or smooths the edges of one; `None`: no device does either.
    unasked: Option<bool>,
    pub stage: Stage,
    pub outputs: Outputs,
    pub frames: Range<u32>,
    /// The record without the frame's number.
    record: Record,
    timings: Timings,
    done: Vec<Done>,
    warnings: Vec<String>,
    /// Of the next frame.
    numbers: serde_json::Map<String, Value>,
    /// Wall-clock time of the steps before the first frame.
    pub phases: Vec<(&'static str, Duration)>,
    /// A black picture is not written but made again with a light.
    pub watched: bool,
    /// The picture would be black.
    pub dark: Option<Dark>,
}

#[derive(Debug, Serialize)]
struct Done {
    frame: u32,
    seconds: f64,
    /// Wall-clock time of the first run, including the readback.
    milliseconds: f64,
    files: Vec<String>,
    /// Numbers of the technique about the cost of the frame.
    #[serde(skip_serializing_if = "serde_json::Map::is_empty")]
    numbers: serde_json::Map<String, Value>,
    /// Times of each run. The first run also creates pipelines and reads the picture back.
    runs: Vec<RunTime>,
}

#[derive(Debug, Serialize)]
struct RunTime {
    milliseconds: f64,
    /// Time of all passes on the device; `null` if the device has no timestamps.
    gpu_milliseconds: Option<f64>,
}

impl<'a> Run<'a> {
    /// Reads the scene and checks that all outputs can be written. With `memory` the run writes no files, and keeps the last picture as the
    /// bytes of a file of this format. `stage`: the scene and the camera, if they were read already.
    pub fn new<S: Serialize>(
        technique: Label,
        args: &'a RenderArgs,
        console: Console,
        settings: &Staged<S>,
        memory: Option<Format>,
        stage: Option<Stage>,
    ) -> Result<Self> {
        let frames = Frames::of(args.frames.as_ref());
        // The names are checked before the scene is read, so that a wrong name is reported at once.
        let mut options = WriteOptions { overwrite: args.overwrite, f32: args.f32, ..WriteOptions::default() };
        let outputs = |options: WriteOptions| match memory {
            Some(format) => Ok(Outputs::in_memory(format, options)),
            None => Outputs::new(&args.output, frames.len(), options),
        };
        outputs(options.clone())?;
        let mut stage = stage.map_or_else(|| Stage::open(&args.stage), Ok)?;
        if !technique.lamps {
            stage.light_by_environment(technique.name);
        }
        let suits = exposure::of_source(&stage.source).filter(|_| !technique.own_light);
        if settings.tonemap.is_some() && !technique.radiance {
            let what = format!(
                "tone mapping needs radiance, but the picture of this mode of {} is not radiance",
                technique.name
            );
            return Err(Error::usage(what).at("tonemap"));
        }
        let radiance = technique.radiance && args.view.is_none();
        let developed = settings.tonemap.is_some() && radiance;
        // A normalised picture needs no automatic exposure.
        let normal = settings.tonemap.as_ref().is_some_and(|tonemap| tonemap.normalize);
        let curve = args.screen.curve(args.paper, radiance, developed)?;
        let exposure = args.exposure.or(suits.filter(|_| radiance && !normal));
        // Tone mapping applies the exposure, so that the file must not apply it again.
        options.exposure_ev = if developed { 0.0 } else { exposure.unwrap_or(0.0) as f32 };
        let outputs = outputs(options)?;
        if outputs.uses_stdout() && args.json {
            return Err(Error::usage("--json and an image both want standard output").help("Give the image a name"));
        }
        let label = match technique.mode {
            Some(mode) if mode != technique.name => format!("{}-{mode}", technique.name),
            _ => technique.name.to_owned(),
        };
        let smooth = smoothing(args, &technique)?;
        let plain = args.view.is_none() && args.dump.is_none() && !args.list_passes && !args.paper;
        let asked = args.smooth.aa.is_some() || args.smooth.aa_frames.is_some();
        let unasked = plain && technique.radiance && frames.len() == 1 && !asked;
        let record = Record {
            first_frame: frames.start,
            frame: frames.start,
            fps: args.fps,
            exposure: exposure.unwrap_or(0.0),
            operator: curve,
            seed: args.seed,
            view: args.view.clone(),
            mode: technique.mode.map(str::to_owned),
            f32: args.f32,
            settings: config::to_value(settings)?,
            ..Record::new(&[technique.name, "render"], &args.stage, &stage)
        };
        let run = Self {
            args,
            console,
            label,
            fit_exposure: exposure.is_none() && radiance && !developed,
            smooth,
            unasked: unasked.then_some(technique.cheap),
            stage,
            outputs,
            frames,
            record,
            timings: Timings::default(),
            done: Vec::new(),
            warnings: Vec::new(),
            numbers: serde_json::Map::new(),
            phases: Vec::new(),
            watched: false,
            dark: None,
        };
        if !args.list_passes {
            run.probe()?;
        }
        Ok(run)
    }

    /// Checks the outputs of the first and the last frame only; the others differ from them in their number.
    fn probe(&self) -> Result<()> {
        for frame in [self.frames.start, self.frames.end - 1] {
            self.outputs.probe(&self.values(frame), &["picture"])?;
        }
        let files = self.args.timings.iter().map(|path| (path, true));
        for (path, overwrite) in files {
            image::probe_output(path, overwrite)?;
        }
        if let Some(folder) = self.args.dump.as_deref().filter(|folder| !folder.is_dir()) {
            std::fs::create_dir_all(folder).map_err(|error| {
                Error::new(ErrorKind::Output, "the folder cannot be made").in_file(folder).caused_by(error)
            })?;
        }
        Ok(())
    }

    /// Tells the user about the scene.
    pub fn tell(&self) {
        let scene = &self.stage.scene;
        let triangles: usize =
            scene.meshes.iter().flat_map(|mesh| &mesh.primitives).map(|primitive| primitive.indices.len() / 3).sum();
        let (lights, materials) = (scene.lights.len(), scene.materials.len());
        self.console.info(&format!(
            "{}: {triangles} triangles, {materials} materials, {lights} lights, camera '{}'",
            scene.name, self.stage.placed.name
        ));
        if triangles == 0 {
            self.console.info("note: meshes: the scene has no triangles, so the picture shows no surfaces");
        }
        self.stage.notes().iter().for_each(|note| self.tell_note(note));
    }

    fn tell_note(&self, note: &Note) {
        let text = format!("note: {}: {}", note.place, note.text);
        match note.kind {
            NoteKind::Repaired => self.console.detail(&text),
            NoteKind::Ignored | NoteKind::Approximated => self.console.info(&text),
        }
    }

    /// Prints the notes of a frame; each note only once per run.
    pub fn note(&mut self, notes: &[Note]) {
        for note in notes {
            if !self.stage.scene.notes.contains(note) {
                self.tell_note(note);
                self.stage.scene.notes.push(note.clone());
            }
        }
    }

    fn values(&self, frame: u32) -> Values<'_> {
        let (scene, camera) = (&self.stage.scene.name, &self.stage.placed.name);
        Values { scene, camera, technique: &self.label, frame, layer: "" }
    }

    /// Chooses the anti-aliasing by the device, if the user has not. Stills are means of several pictures, which a GPU renders in little time with
    /// every technique; where one picture takes a CPU driver seconds, its light serves all places inside the pixels. The average over time of
    /// a sequence flickers while the camera rests, so sequences have it on request alone.
    pub fn smooth_on(&mut self, gpu: &Gpu) {
        if let Some(cheap) = self.unasked {
            let quick = cheap || gpu.describe().kind != DeviceKind::Cpu;
            self.smooth = match quick {
                true => Smooth { count: smooth::STILL, ..self.smooth },
                false => Smooth { edges: true, ..self.smooth },
            };
        }
        self.record.aa = self.smooth;
    }

    /// Names the layers of the next picture that have no mean.
    pub fn name_exact(&mut self, layers: Vec<String>) {
        self.record.exact = layers;
    }

    /// Names the file of a bake in the metadata of pictures.
    pub fn name_bake(&mut self, bake: Option<BakeFile>) {
        self.record.bake = bake;
    }

    /// The metadata of a picture.
    pub fn metadata(&self, gpu: &Gpu, view: &View, frame: u32) -> Result<Metadata> {
        let about = gpu.describe();
        Ok(Metadata {
            program: self.record.command.join(" "),
            version: program::VERSION.into(),
            revision: program::revision().map(str::to_owned),
            scene: self.stage.scene.name.clone(),
            scene_hash: self.record.fingerprint.clone(),
            camera: self.stage.placed.name.clone(),
            technique: self.label.clone(),
            seed: self.args.seed.into(),
            device: about.device.clone(),
            driver: format!("{} {}", about.driver, about.driver_info).trim().to_owned(),
            shader_compiler: lucerna::shaders::COMPILER.to_owned(),
            config: config::to_value(&Record { frame, ..self.record.clone() })?,
            world_to_camera: Some(view.view_from_world.to_cols_array()),
            world_to_ndc: Some(view.clip_from_world.to_cols_array()),
            ..Metadata::default()
        })
    }

    /// The exposure, EV: given by the user, or chosen by the first frame.
    pub fn exposure(&self) -> f64 {
        self.record.exposure
    }

    /// Whether the picture of the first frame would be black and should be made again.
    pub fn is_dark(&mut self, picture: &Layers, pose: &Pose, view: &View) -> bool {
        if self.watched && self.done.is_empty() {
            self.dark = relight::dark(picture, &self.stage, pose, view);
        }
        self.dark.is_some()
    }

    /// The curve of files for screens; `None`: they show the light as it is, or there is no such file.
    pub fn curve(&self) -> Option<Operator> {
        self.record.operator.filter(|_| self.outputs.wants_screen())
    }

    /// Chooses the exposure by the first frame, if the user gave none.
    pub fn expose(&mut self, picture: &Layers) {
        if self.done.is_empty() && exposure::is_black(picture) {
            self.console
                .info("note: the picture is black (--default-light always adds a sun, --light and --sun add others)");
        }
        if !std::mem::take(&mut self.fit_exposure) {
            return;
        }
        let ev = exposure::fitting(picture);
        if ev != 0.0 {
            self.console.info(&format!(
                "note: the exposure of .png files was set to {ev:+} EV, to fit the screen's range (--exposure)"
            ));
        }
        self.record.exposure = ev;
        self.outputs.expose(ev);
    }

    /// Writes the files of a frame and returns their names. `shown`: the picture of files for screens, if it is another one.
    pub fn write(&mut self, layers: &Layers, shown: Option<&Layers>, frame: u32) -> Result<Vec<String>> {
        let (scene, camera) = (&self.stage.scene.name, &self.stage.placed.name);
        let values = Values { scene, camera, technique: &self.label, frame, layer: "" };
        let written = self.outputs.write(&values, layers, shown)?;
        for (name, report) in &written {
            if !report.is_finite() {
                let first = report.first.as_deref().unwrap_or_default();
                let (nan, infinite) = (report.nan, report.infinite);
                self.warn(format!("{name}: {nan} values are not numbers, {infinite} are infinite; first: {first}"));
            }
            if report.alpha_left_out {
                self.warn(format!("{name}: {}", ALPHA_LEFT_OUT));
            }
        }
        Ok(written.into_iter().map(|(name, _)| name).collect())
    }

    /// Writes an image of the graph into the `--dump` folder.
    pub fn dump(&self, folder: &Path, frame: u32, name: &str, layers: Layers) -> Result<()> {
        let path = folder.join(format!("{frame:04}-{}.exr", crate::pattern::file_part(name)));
        image::write(&path, &layers, &WriteOptions { overwrite: self.args.overwrite, ..Default::default() })?;
        Ok(())
    }

    fn warn(&mut self, text: String) {
        self.console.warning(&text);
        self.warnings.push(text);
    }

    /// Records numbers about the cost of the frame that is finished next.
    pub fn numbers(&mut self, numbers: &[(&str, f64)]) {
        self.numbers = numbers.iter().map(|(name, number)| ((*name).to_owned(), json!(number))).collect();
    }

    /// Records a finished frame. `milliseconds`: of all of it, with the readback. `runs`: the time and the report of each picture that was rendered for it.
    pub fn done(&mut self, frame: u32, seconds: f64, milliseconds: f64, files: Vec<String>, runs: &[(f64, Report)]) {
        let numbers = std::mem::take(&mut self.numbers);
        self.done.push(Done { frame, seconds, milliseconds, files, numbers, runs: Vec::new() });
        runs.iter().for_each(|(milliseconds, report)| self.again(*milliseconds, report));
    }

    /// Records one more rendering of the last frame.
    pub fn again(&mut self, milliseconds: f64, report: &Report) {
        if let Some(done) = self.done.last_mut() {
            self.timings.add(done.frame, report);
            done.runs.push(RunTime { milliseconds, gpu_milliseconds: report.gpu_ms() });
        }
    }

    /// The picture in memory, if all frames are finished.
    pub fn fresh(self) -> Option<Fresh> {
        let whole = self.done.len() == self.frames.len();
        self.outputs.fresh().filter(|_| whole)
    }

    /// Number of finished frames, and of all frames.
    pub fn progress(&self) -> (usize, usize) {
        (self.done.len(), self.frames.len())
    }

    /// Writes the timings and prints the JSON document, if they were asked for.
    pub fn finish(&self, gpu: &Gpu) -> Result<()> {
        if let Some(path) = &self.args.timings {
            self.timings.write(path)?;
        }
        if self.args.json {
            console::print_json(&self.json(gpu)?)?;
        }
        Ok(())
    }

    fn json(&self, gpu: &Gpu) -> Result<Value> {
        let about = gpu.describe();
        let runs = || self.done.iter().flat_map(|done| &done.runs);
        let median = |mut values: Vec<f64>| {
            values.sort_by(f64::total_cmp);
            values.get(values.len() / 2).copied()
        };
        let phases: serde_json::Map<String, Value> =
            self.phases.iter().map(|(name, time)| ((*name).to_owned(), json!(time.as_secs_f64() * 1e3))).collect();
        Ok(json!({
            "program": self.record.command.join(" "),
            "version": program::VERSION,
            "revision": program::revision(),
            "device": about.device,
            "driver": format!("{} {}", about.driver, about.driver_info).trim(),
            "scene": self.stage.scene.name,
            "camera": self.stage.placed.name,
            "technique": self.label,
            "aa": self.smooth,
            "config": config::to_value(&self.record)?,
            "phases_ms": phases,
            "frames": console::to_json(&self.done)?,
            "first_frame_ms": self.done.first().map(|done| done.milliseconds),
            "median_ms": median(runs().map(|run| run.milliseconds).collect()),
            "median_gpu_ms": median(runs().filter_map(|run| run.gpu_milliseconds).collect()),
            "notes": console::to_json(&self.stage.notes())?,
            "warnings": self.warnings,
            "complete": self.done.len() == self.frames.len(),
        }))
    }
}

/// The anti-aliasing that the user asks for.
fn smoothing(args: &RenderArgs, technique: &Label) -> Result<Smooth> {
    let SmoothArgs { aa, filter, aa_frames: frames } = args.smooth;
    let wrong = |what: String, help: &str| Err(Error::usage(what).at("--aa").help(help));
    let none = matches!(aa, None | Some(Aa::Mean(1))) && frames.is_none();
    if !none && !technique.radiance {
        let mode = technique.mode.unwrap_or("this mode");
        let what = format!("the picture of {mode} of {} is not light, so --aa cannot smooth it", technique.name);
        return wrong(what, "Leave --aa out, or render all light");
    }
    let single =
        [("--view", args.view.is_some()), ("--dump", args.dump.is_some()), ("--list-passes", args.list_passes)];
    if let Some((option, _)) = single.into_iter().find(|(_, given)| *given && matches!(aa, Some(Aa::Mean(2..)))) {
        return wrong(format!("the argument '--aa <N>' cannot be used with '{option}'"), "Leave one of them out");
    }
    if frames.is_some() && matches!(aa, Some(Aa::Mean(_) | Aa::Edges)) {
        let what = "'--aa-frames <N>' works only with --aa temporal".to_owned();
        return wrong(what, "Leave --aa-frames out, or give --aa temporal");
    }
    let one = Smooth { filter, ..Smooth::default() };
    Ok(match aa {
        Some(Aa::Mean(count)) => Smooth { count, ..one },
        Some(Aa::Temporal) => Smooth { temporal: frames.or(Some(temporal::FRAMES)), ..one },
        Some(Aa::Edges) => Smooth { edges: true, ..one },
        None => Smooth { temporal: frames, ..one },
    })
}
