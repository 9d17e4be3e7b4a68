//! Tone mapping as the last stage of every technique: `-D tonemap.operator=reinhard`.
//!
//! Without any setting of the group `tonemap` a picture is not tone mapped and stays radiance.
//!
//! Ashikhmin's operator needs luminance in cd/m², which a render does not have. Unless `tonemap.exposure` or `tonemap.normalize` are set, the
//! log-average of the picture is scaled to 18 cd/m² (by `normalize` and a fitting exposure); in sequences it follows the adaptation.

use lucerna::{
    Error, ErrorKind, Result,
    gpu::Gpu,
    graph::{Graph, Runner},
    image::{Layer, Layers},
    passes::{self, gbuffer},
    resident::Resident,
    scene::{Pose, Scene, View, chosen::Chosen},
    technique::Picture,
    techniques::tonemap::{self, Input, Mode, Operator, Still, Tonemap},
};
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use serde_json::{Map, Value};

use crate::{
    config::{self, SettingsArgs},
    effects,
};

/// Settings of a technique and, if any is set, of the tone mapping after it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Staged<S> {
    #[serde(flatten)]
    pub technique: S,
    /// The post-processing pipeline between the technique and the tone mapping.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub effects: Option<effects::Settings>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tonemap: Option<tonemap::Settings>,
}

/// Luminance to which the log-average is scaled for an operator that works in cd/m²: 18 % of a screen's white of 100.
const GREY: f32 = 18.0;

/// The layer that has the matte of the important objects.
pub const MATTE: &str = "chosen";

/// The group of settings.
const GROUP: &str = "tonemap";

impl<S: Serialize + DeserializeOwned + Clone> Staged<S> {
    /// The settings in effect over `base`, checked by `check`. `paper`: tone mapping has the settings of the papers by default.
    ///
    /// # Errors
    /// `Usage` or, with the file's name, `Input`, naming the key.
    pub fn effective(args: &SettingsArgs, base: &S, paper: bool, check: impl Fn(&S) -> Result<()>) -> Result<Self> {
        let checked = |settings: &Self| {
            check(&settings.technique)?;
            settings.tonemap.as_ref().map_or(Ok(()), |tonemap| tonemap.validate().map_err(|error| error.at(GROUP)))
        };
        for key in ["effects.pipeline", "effects.digest"] {
            if args.define.iter().any(|define| define.split('=').next().is_some_and(|name| name.trim() == key)) {
                return Err(Error::usage("is decided by --effects FILE.toml").at(key));
            }
        }
        let settings = Self::unchecked(args, base, paper)?;
        if let (Some(file), Err(error)) = (&args.effects, checked(&settings)) {
            let alone = SettingsArgs { effects: Some(file.clone()), ..SettingsArgs::default() };
            let of_pipeline = Self::unchecked(&alone, base, paper).and_then(|settings| checked(&settings));
            if of_pipeline.is_err_and(|own| own.to_string() == error.to_string()) {
                return Err(error.of_kind(ErrorKind::Input).at("settings").in_file(file));
            }
        }
        args.blamed(checked(&settings), || checked(&Self::unchecked(&args.file_alone(), base, paper)?))?;
        Ok(settings)
    }

    /// The settings from a picture's metadata; settings that it does not name have the value of `base`.
    ///
    /// # Errors
    /// `Input`, naming the key.
    pub fn recorded(settings: &Value, base: &S, check: impl Fn(&S) -> Result<()>) -> Result<Self> {
        let wrong = |error: Error| error.of_kind(ErrorKind::Input).at("settings");
        let Value::Object(changes) = without_nulls(settings) else {
            return Err(wrong(Error::input("are no table")));
        };
        let tonemap = changes.contains_key(GROUP).then(tonemap::Settings::default);
        let effects = effects::recorded(&changes).map_err(wrong)?;
        let base = Self { technique: base.clone(), effects, tonemap };
        let staged = config::with(&base, &changes).map_err(wrong)?;
        check(&staged.technique).map_err(wrong)?;
        if let Some(tonemap) = &staged.tonemap {
            tonemap.validate().map_err(|error| wrong(error.at(GROUP)))?;
        }
        Ok(staged)
    }

    fn unchecked(args: &SettingsArgs, base: &S, paper: bool) -> Result<Self> {
        let asked = args.define.iter().any(|define| define.starts_with("tonemap."));
        let in_file = |text: String| text.parse::<toml::Table>().is_ok_and(|table| table.contains_key(GROUP));
        // Errors of the file are reported below, with its name.
        let wanted = asked || args.file.as_deref().is_some_and(|file| config::read_text(file).is_ok_and(in_file));
        let pipeline = args.effects.as_deref().map(effects::read).transpose()?;
        let effects = pipeline.as_deref().map(effects::Settings::of);
        // What the pipeline's file says of the technique is a default.
        let own: Map<String, Value> = match &pipeline {
            Some(pipeline) => serde_json::to_value(&pipeline.settings)
                .ok()
                .and_then(|value| value.as_object().cloned())
                .unwrap_or_default(),
            None => Map::new(),
        };
        let wanted = wanted || own.contains_key(GROUP);
        let over = |settings: tonemap::Settings| -> Result<Self> {
            let base = Self { technique: base.clone(), effects: effects.clone(), tonemap: wanted.then_some(settings) };
            let base = config::with(&base, &own).map_err(|error| match &pipeline {
                Some(pipeline) => error.of_kind(ErrorKind::Input).at("settings").in_file(&pipeline.path),
                None => error,
            })?;
            let mut made = args.with_effects(&base)?;
            if let (Some(pipeline), Some(effects)) = (&pipeline, &mut made.effects) {
                // A settings file may be of another time.
                let of = effects::Settings::of(pipeline);
                (effects.pipeline, effects.digest) = (of.pipeline, of.digest);
                pipeline.check(&effects.values).map_err(|error| error.at(effects::GROUP))?;
            }
            Ok(made)
        };
        let plain = if paper { tonemap::Settings::paper() } else { tonemap::Settings::default() };
        let grey = tonemap::Settings { normalize: true, exposure: GREY.log2(), ..plain.clone() };
        let mut settings = over(plain.clone())?;
        if settings.tonemap.as_ref().is_some_and(|s| s.operator == Operator::Ashikhmin) {
            // The settings are computed over two different bases. A value that follows its base in both cases was not set by the user.
            let (other, unit) = (over(grey.clone())?, |s: &tonemap::Settings| (s.normalize, s.exposure));
            if settings.tonemap.as_ref().map(unit) == Some(unit(&plain))
                && other.tonemap.as_ref().map(unit) == Some(unit(&grey))
            {
                settings = other;
            }
        }
        Ok(settings)
    }
}

/// The settings without null values. A setting that is `None` is then not written, but its key stays valid.
fn without_nulls(value: &Value) -> Value {
    match value {
        Value::Object(table) => {
            let kept = table.iter().filter(|(_, value)| !value.is_null());
            Value::Object(kept.map(|(key, value)| (key.clone(), without_nulls(value))).collect())
        }
        other => other.clone(),
    }
}

/// Whether settings, as JSON, have tone mapping.
pub fn is_developed(settings: &Value) -> bool {
    settings.get(GROUP).is_some_and(|tonemap| !tonemap.is_null())
}

/// The objects whose pixels are important to the tone mapping; `None`: no objects are named.
///
/// # Errors
/// `Usage` if the scene has no object of a name, or if the tone mapping is not selective.
pub fn important(scene: &Scene, settings: Option<&tonemap::Settings>) -> Result<Option<Chosen>> {
    let Some(settings) = settings.filter(|settings| !settings.important.trim().is_empty()) else { return Ok(None) };
    let chosen = match settings.mode() {
        Mode::Selective => Chosen::by_names(scene, &settings.important),
        mode => {
            let what = format!("'{}' is important, but tonemap.mode is {}", settings.important, mode.name());
            Err(Error::usage(what).help("Use tonemap.mode=selective, or name no objects"))
        }
    };
    chosen.map(Some).map_err(|error| error.at("tonemap.important"))
}

/// The layer with the matte of the important objects, for [`still`] of a picture whose renderer has no G-buffer. `None` as for [`important`].
///
/// # Errors
/// As [`important`]; `OutOfMemory`, `DeviceLost`.
pub fn matte(
    gpu: &Gpu,
    (scene, pose): (&Scene, &Pose),
    view: &View,
    settings: Option<&tonemap::Settings>,
) -> Result<Option<Layer>> {
    let Some(chosen) = important(scene, settings)? else { return Ok(None) };
    let mut resident = Resident::new(gpu, scene)?;
    let mut graph = Graph::new(MATTE);
    let handles = resident.frame_in(&mut graph, scene, pose);
    let view = view.fit_far(&handles.bounds());
    let surfaces = gbuffer::draw(&mut graph, &handles, &view, &gbuffer::Settings::default());
    let matte = passes::matte::draw(&mut graph, &handles, &surfaces, &view, &chosen);
    let read = graph.read_image(matte);
    let mut frame = Runner::new(gpu).run(&graph)?;
    let values = frame.take_floats(read).into_iter().map(|[value, ..]| value).collect();
    Ok(Some(Layer::new(MATTE, &["Y"], values)))
}

/// The tone mapping stage of a run over frames.
#[derive(Debug)]
pub struct LastStage {
    gpu: Gpu,
    /// With the exposure of the run; `None`: pictures stay radiance.
    settings: Option<tonemap::Settings>,
    tonemap: Option<Tonemap>,
    /// For pictures in host memory.
    still: Option<Still>,
}

impl LastStage {
    /// `ev`: stops added before the exposure of the settings.
    ///
    /// # Errors
    /// `OutOfMemory`; `Usage` if the stops are too many.
    pub fn new(gpu: &Gpu, settings: Option<&tonemap::Settings>, ev: f64) -> Result<Self> {
        let settings = settings.map(|settings| exposed(settings, ev));
        let tonemap = settings.as_ref().map(|settings| Tonemap::new(gpu, settings)).transpose()?;
        Ok(Self { gpu: gpu.clone(), settings, tonemap, still: None })
    }

    /// Lets the stage develop the picture of a frame, whose matte has the important objects. `dt`: seconds since the previous frame.
    ///
    /// # Errors
    /// `Usage` if the picture cannot be tone mapped as the settings ask.
    pub fn frame(&mut self, graph: &mut Graph, picture: &mut Picture, dt: f32) -> Result<()> {
        let Some(tonemap) = &mut self.tonemap else { return Ok(()) };
        let mask = picture.matte;
        picture.develop(|color| Ok(tonemap.frame(graph, Input { color, mask }, Some(dt))?.mapped))
    }

    /// Applies the stage to a picture in host memory, as [`Self::frame`]. The picture before the stage becomes the layer `light`.
    ///
    /// # Errors
    /// As [`still`].
    pub fn mean(&mut self, layers: &mut Layers, dt: f32) -> Result<()> {
        let Some(settings) = &self.settings else { return Ok(()) };
        let still = match &mut self.still {
            Some(still) => still,
            none => none.insert(Still::new(&self.gpu, settings)?),
        };
        developed(still, layers, Some(dt))
    }
}

fn exposed(settings: &tonemap::Settings, ev: f64) -> tonemap::Settings {
    tonemap::Settings { exposure: settings.exposure + ev as f32, ..settings.clone() }
}

/// Applies the stage to one picture in host memory. The picture before the stage becomes the layer `light`.
///
/// # Errors
/// `Input` for bad values if the settings refuse them; `OutOfMemory`, `DeviceLost`.
pub fn still(gpu: &Gpu, settings: &tonemap::Settings, ev: f64, layers: &mut Layers) -> Result<()> {
    developed(&mut Still::new(gpu, &exposed(settings, ev))?, layers, None)
}

fn developed(still: &mut Still, layers: &mut Layers, dt: Option<f32>) -> Result<()> {
    let Some(main) = layers.layers.iter().position(|layer| layer.name.is_empty()) else { return Ok(()) };
    let Some(pixels) = layers.layers[main].rgb_pixels() else { return Ok(()) };
    let pixels = pixels.into_iter().map(|[r, g, b]| [r, g, b, 1.0]).collect();
    let matte = layers.layers.iter().find(|layer| layer.name == MATTE).map(|layer| layer.data.as_slice());
    let mapped = still.map(layers.width, layers.height, pixels, matte, dt)?;
    let light = Layer { name: "light".into(), ..layers.layers[main].clone() };
    layers.layers[main] = Layer::rgb("", &mapped.pixels);
    layers.layers.push(light);
    Ok(())
}

#[cfg(test)]
mod tests {
    use lucerna::techniques::{isr::PictureSettings, tonemap::Operator};

    use super::*;

    fn with(defines: &[&str]) -> Result<Staged<PictureSettings>> {
        let define = defines.iter().map(|&d| d.to_owned()).collect();
        Staged::effective(
            &SettingsArgs { define, ..SettingsArgs::default() },
            &PictureSettings::default(),
            false,
            PictureSettings::validate,
        )
    }

    #[test]
    fn only_if_asked_for_and_both_groups_are_checked() {
        let plain = with(&["isr.samples=24"]).unwrap();
        assert!(plain.tonemap.is_none() && plain.technique.isr.samples == 24);
        assert!(!config::to_toml(&plain).unwrap().contains("tonemap"));
        let both = with(&["tonemap.operator=agx", "tonemap.exposure=0.1", "isr.samples=24"]).unwrap();
        let tonemap = both.tonemap.as_ref().unwrap();
        assert_eq!((tonemap.operator, tonemap.exposure, both.technique.isr.samples), (Operator::Agx, 0.1, 24));
        for bad in
            ["tonemap.operater=agx", "tonemap.operator=ward", "isr.sampels=3", "tonemap.radius=99", "isr.samples=25"]
        {
            let error = with(&[bad]).unwrap_err();
            assert_eq!(error.exit_code(), 2, "{bad}: {error}");
        }
        assert!(with(&["isr.sampels=3"]).unwrap_err().to_string().contains("isr.samples"));
    }

    #[test]
    fn what_is_wrong_in_a_file_is_the_files_fault() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("s.toml");
        let told = |text: &str, defines: &[&str]| {
            std::fs::write(&file, text).unwrap();
            let define = defines.iter().map(|&d| d.to_owned()).collect();
            let args = SettingsArgs { define, file: Some(file.clone()), ..SettingsArgs::default() };
            let settings = Staged::effective(&args, &PictureSettings::default(), false, PictureSettings::validate);
            settings.map(|_| ()).map_err(|error| (error.exit_code(), error.to_string()))
        };
        for (text, key) in [("[isr]\nbounces = 9", "isr.bounces: 9"), ("[tonemap]\nradius = 99", "tonemap.radius: 99")]
        {
            let (code, error) = told(text, &["isr.layers=2"]).unwrap_err();
            assert!(code == 3 && error.contains(&format!("s.toml: {key}")), "{code} {error}");
        }
        // -D overrides the file: it can correct a value of the file, or make it wrong.
        told("[isr]\nbounces = 9", &["isr.bounces=2"]).unwrap();
        for text in ["[isr]\nbounces = 2", "[isr]\nbounces = 9"] {
            let (code, error) = told(text, &["isr.bounces=8"]).unwrap_err();
            assert!(code == 2 && error.starts_with("isr.bounces: 8"), "{code} {error}");
        }
    }

    #[test]
    fn ashikhmin_gets_light_in_its_unit_unless_told_otherwise() {
        let unit = |defines: &[&str]| {
            let s = with(defines).unwrap().tonemap.unwrap();
            (s.normalize, s.exposure)
        };
        assert_eq!(unit(&["tonemap.operator=ashikhmin"]), (true, GREY.log2()));
        assert_eq!(unit(&["tonemap.mode=global"]), (true, GREY.log2()));
        assert_eq!(unit(&["tonemap.exposure=0", "tonemap.mode=global"]), (false, 0.0));
        assert_eq!(unit(&["tonemap.exposure=2"]), (false, 2.0));
        assert_eq!(unit(&["tonemap.normalize=true"]), (true, 0.0));
        assert_eq!(unit(&["tonemap.normalize=false"]), (false, 0.0));
        assert_eq!(unit(&["tonemap.operator=aces"]), (false, 0.0));
    }

    #[test]
    fn the_papers_tone_mapping() {
        let of = |paper| {
            let define = vec!["tonemap.operator=ashikhmin".to_owned()];
            let args = SettingsArgs { define, ..SettingsArgs::default() };
            let settings = Staged::effective(&args, &PictureSettings::default(), paper, PictureSettings::validate);
            settings.unwrap().tonemap.unwrap()
        };
        assert_eq!((of(true).saturation(), of(true).contrast_limit(), of(true).normalize), (1.0, None, true));
        assert_eq!((of(false).saturation(), of(false).contrast_limit()), (0.7, Some(1.2)));
    }

    #[test]
    fn printed_settings_read_back_the_same() {
        let settings = with(&["tonemap.operator=reinhard", "isr.samples=24"]).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("s.toml");
        std::fs::write(&file, config::to_toml(&settings).unwrap()).unwrap();
        let args = SettingsArgs { file: Some(file), ..SettingsArgs::default() };
        let read = Staged::effective(&args, &PictureSettings::default(), false, PictureSettings::validate).unwrap();
        assert_eq!(read, settings);
    }
}
