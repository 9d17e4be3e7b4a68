//! The TOML file of a pipeline, with the line of each mistake.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use serde::Deserialize;
use serde_json::Value;
use toml::Spanned;

use super::{Constant, Number, OwnImage, PICTURE, Pass, Pipeline, Size, Source, Values, Work, program};
use crate::{
    Error, Result,
    graph::{Format, Sampler},
    image::read_text_checked,
    technique::Technique,
    techniques, tracer,
};

/// Bytes of a file or shader at most.
const MOST: u64 = 1 << 20;
/// Keys that the viewer leaves to pipelines.
const KEYS: [&str; 6] = ["F6", "F7", "F8", "F9", "F11", "F12"];
/// Files of a pipeline at most.
const MOST_FILES: usize = 512;
/// Passes of a pipeline at most.
const MOST_PASSES: usize = 256;

/// Formats of images by their names in files.
const FORMATS: [(&str, Format); 14] = [
    ("r8", Format::R8),
    ("rg8", Format::RG8),
    ("rgba8", Format::RGBA8),
    ("r16f", Format::R16F),
    ("rg16f", Format::RG16F),
    ("rgba16f", Format::RGBA16F),
    ("r32f", Format::R32F),
    ("rg32f", Format::RG32F),
    ("rgba32f", Format::RGBA32F),
    ("r32u", Format::R32U),
    ("rg32u", Format::RG32U),
    ("rgba32u", Format::RGBA32U),
    ("r32i", Format::R32I),
    ("r11g11b10f", Format::R11G11B10F),
];

const SAMPLERS: [(&str, Sampler); 5] = [
    ("linear", Sampler::Linear),
    ("nearest", Sampler::Nearest),
    ("trilinear", Sampler::Trilinear),
    ("repeat", Sampler::Repeat),
    ("nearest-repeat", Sampler::NearestRepeat),
];

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    title: Option<String>,
    #[serde(default)]
    doc: String,
    technique: Option<Spanned<String>>,
    #[serde(default)]
    settings: toml::Table,
    #[serde(default)]
    constants: BTreeMap<String, Spanned<FileConstant>>,
    #[serde(default)]
    images: BTreeMap<String, Spanned<FileImage>>,
    #[serde(default, rename = "pass")]
    passes: Vec<Spanned<FilePass>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FileConstant {
    default: toml::Value,
    least: Option<f64>,
    most: Option<f64>,
    #[serde(default)]
    doc: String,
    #[serde(default)]
    unit: String,
    key: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FileImage {
    format: String,
    scale: Option<f64>,
    size: Option<[u32; 2]>,
    #[serde(default)]
    mips: bool,
    #[serde(default)]
    history: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FilePass {
    name: Option<String>,
    shader: Option<String>,
    stage: Option<String>,
    image: Option<String>,
    radius: Option<toml::Value>,
    out: Option<OneOrMore>,
    #[serde(default)]
    bind: BTreeMap<String, FileSource>,
    #[serde(default)]
    values: toml::Table,
    when: Option<OneOrMore>,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "a name, or a list of names")]
enum OneOrMore {
    One(String),
    More(Vec<String>),
}

impl OneOrMore {
    fn list(self) -> Vec<String> {
        match self {
            Self::One(name) => vec![name],
            Self::More(names) => names,
        }
    }
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "the name of an image, or a table of image, sampler and mip")]
enum FileSource {
    Name(String),
    Full(FullSource),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FullSource {
    image: String,
    sampler: Option<String>,
    mip: Option<u32>,
}

/// A text with the lines of its bytes.
struct Lines<'a> {
    path: &'a Path,
    text: &'a str,
}

impl Lines<'_> {
    fn of(&self, at: usize) -> usize {
        1 + self.text.as_bytes()[..at.min(self.text.len())].iter().filter(|byte| **byte == b'\n').count()
    }

    fn wrong(&self, line: usize, what: impl Into<String>) -> Error {
        Error::input(what).at(format!("line {line}")).in_file(self.path)
    }
}

fn names<T>(list: &[(&'static str, T)]) -> String {
    list.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ")
}

fn named<T: Copy>(list: &[(&'static str, T)], name: &str) -> Option<T> {
    list.iter().find(|(known, _)| *known == name).map(|(_, value)| *value)
}

fn is_name(name: &str) -> bool {
    !name.is_empty()
        && name.len() <= 64
        && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
        && !name.starts_with(|c: char| c.is_ascii_digit())
}

fn json(value: &toml::Value) -> Option<Value> {
    let number = |value: &toml::Value| match value {
        toml::Value::Integer(n) => Some(Value::from(*n)),
        toml::Value::Float(n) if n.is_finite() => serde_json::Number::from_f64(*n).map(Value::Number),
        _ => None,
    };
    match value {
        toml::Value::Boolean(on) => Some(Value::Bool(*on)),
        toml::Value::Array(list) if (2..=4).contains(&list.len()) => list
            .iter()
            .map(|value| number(value).and_then(|n| n.as_f64()).map(Value::from))
            .collect::<Option<Vec<_>>>()
            .map(Value::Array),
        other => number(other),
    }
}

/// The texts of a pipeline by their files: its own, its shaders and what they include, as far as they are there.
pub(super) type Texts = BTreeMap<PathBuf, String>;

/// The folder of a pipeline.
pub(super) fn folder_of(path: &Path) -> PathBuf {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new(".")).to_owned()
}

/// The files of a pipeline with their texts; `None` for one that is named, but is not there.
pub(super) fn gathered(path: &Path) -> Result<BTreeMap<PathBuf, Option<String>>> {
    let own = read_text_checked(path, MOST)?;
    let folder = folder_of(path);
    // A file with mistakes has the shaders that its lines name.
    let named = |text: &str, begins: &str| -> Vec<String> {
        let lines = text.lines().filter_map(|line| line.trim_start().strip_prefix(begins).map(str::to_owned));
        lines.filter_map(|rest| Some(rest.split('"').nth(1)?.to_owned())).collect()
    };
    let mut open = match own.parse::<toml::Table>() {
        Ok(table) => {
            let passes = table.get("pass").and_then(toml::Value::as_array).into_iter().flatten();
            passes.filter_map(|pass| Some(pass.get("shader")?.as_str()?.to_owned())).collect()
        }
        Err(_) => named(&own, "shader"),
    };
    let mut all = BTreeMap::from([(path.to_owned(), Some(own))]);
    while let Some(name) = open.pop() {
        let inside = Path::new(&name).components().all(|part| matches!(part, std::path::Component::Normal(_)));
        let file = folder.join(&name);
        if !inside
            || all.contains_key(&file)
            || (program::is_of_engine(&name) && !file.is_file())
            || all.len() > MOST_FILES
        {
            continue;
        }
        let text = if file.exists() { Some(read_text_checked(&file, MOST)?) } else { None };
        open.extend(text.iter().flat_map(|text| named(text, "#include")));
        all.insert(file, text);
    }
    Ok(all)
}

fn digest_of(texts: &Texts) -> String {
    let mut digest = blake3::Hasher::new();
    for text in texts.values() {
        digest.update(&(text.len() as u64).to_le_bytes()).update(text.as_bytes());
    }
    digest.finalize().to_hex()[..32].to_owned()
}

pub(super) fn digest(path: &Path) -> Result<String> {
    Ok(digest_of(&gathered(path)?.into_iter().filter_map(|(file, text)| Some((file, text?))).collect()))
}

pub(super) fn read(path: &Path) -> Result<Pipeline> {
    let texts: Texts = gathered(path)?.into_iter().filter_map(|(file, text)| Some((file, text?))).collect();
    let text = texts.get(path).cloned().unwrap_or_default();
    let lines = Lines { path, text: &text };
    let file: File = toml::from_str(&text).map_err(|error| {
        let line = error.span().map_or(1, |span| lines.of(span.start));
        lines.wrong(line, error.message().replace('\n', " ").trim().to_owned())
    })?;
    let mut technique = None;
    if let Some(name) = file.technique {
        // The path tracer has no passes after it.
        let known: Vec<&str> =
            techniques::NAMES.iter().copied().filter(|name| *name != tracer::Reference::NAME).collect();
        if !known.contains(&name.as_ref().as_str()) {
            let what = format!("technique {:?}; there are {}", name.as_ref(), known.join(", "));
            return Err(lines.wrong(lines.of(name.span().start), what));
        }
        technique = Some(name.into_inner());
    }
    let mut constants: Vec<(usize, Constant)> = Vec::new();
    for (name, constant) in file.constants {
        let start = constant.span().start;
        constants.push((start, self::constant(&lines, lines.of(start), name, constant.into_inner())?));
    }
    constants.sort_by_key(|(start, _)| *start);
    for (at, (start, constant)) in constants.iter().enumerate() {
        if let Some(key) = &constant.key
            && constants[..at].iter().any(|(_, other)| other.key.as_ref() == Some(key))
        {
            return Err(
                lines.wrong(lines.of(*start), format!("constants.{}: another switch has the key {key}", constant.name))
            );
        }
    }
    let constants: Vec<Constant> = constants.into_iter().map(|(_, constant)| constant).collect();
    let mut images = BTreeMap::new();
    for (name, image) in file.images {
        let line = lines.of(image.span().start);
        if !is_name(&name) || name == PICTURE {
            return Err(
                lines.wrong(line, format!("{name:?} cannot name an image: letters, digits and _, and not {PICTURE:?}"))
            );
        }
        images.insert(name.clone(), own_image(&lines, line, &name, image.into_inner())?);
    }
    if file.passes.len() > MOST_PASSES {
        return Err(lines.wrong(1, format!("{} passes; at most {MOST_PASSES}", file.passes.len())));
    }
    if file.passes.is_empty() {
        return Err(lines
            .wrong(1, "there is no pass")
            .help("Add one: [[pass]] with shader = \"FILE.frag\" and out = \"picture\""));
    }
    let folder = folder_of(path);
    let mut passes = Vec::new();
    for found in file.passes {
        let line = lines.of(found.span().start);
        passes.push(pass(&lines, line, (&folder, &texts), (&constants, &images), found.into_inner())?);
    }
    let stem = || path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    Ok(Pipeline {
        digest: digest_of(&texts),
        path: path.to_owned(),
        title: file.title.unwrap_or_else(stem),
        doc: file.doc,
        technique,
        settings: file.settings,
        constants,
        images,
        passes,
        files: texts.into_keys().collect(),
    })
}

fn constant(lines: &Lines<'_>, line: usize, name: String, found: FileConstant) -> Result<Constant> {
    if !is_name(&name) || program::BUILT_IN.contains(&name.as_str()) || ["pipeline", "digest"].contains(&name.as_str())
    {
        let own = program::BUILT_IN.join(", ");
        return Err(lines.wrong(
            line,
            format!("{name:?} cannot name a constant: letters, digits and _, and none of {own}, pipeline, digest"),
        ));
    }
    let Some(default) = json(&found.default) else {
        let what = format!(
            "constants.{name}.default is {}; a number, true or false, or a list of 2 to 4 numbers is allowed",
            found.default
        );
        return Err(lines.wrong(line, what));
    };
    if found.key.is_some() && !default.is_boolean() {
        return Err(
            lines.wrong(line, format!("constants.{name} has a key, but only true and false can be switched by a key"))
        );
    }
    if let Some(key) = &found.key
        && !KEYS.contains(&key.as_str())
    {
        return Err(lines.wrong(line, format!("constants.{name}.key is {key:?}; {} are allowed", KEYS.join(", "))));
    }
    let constant =
        Constant { name, doc: found.doc, unit: found.unit, default, range: [found.least, found.most], key: found.key };
    let default = constant.default.clone();
    constant
        .check(&default)
        .map_err(|error| lines.wrong(line, format!("constants.{}.default: {}", constant.name, error.what())))?;
    Ok(constant)
}

fn own_image(lines: &Lines<'_>, line: usize, name: &str, found: FileImage) -> Result<OwnImage> {
    let Some(format) = named(&FORMATS, &found.format) else {
        let what = format!("images.{name}.format is {:?}; there are {}", found.format, names(&FORMATS));
        return Err(lines.wrong(line, what));
    };
    let size = match (found.scale, found.size) {
        (Some(_), Some(_)) => {
            return Err(lines.wrong(line, format!("images.{name} has scale and size; one of them decides")));
        }
        (_, Some(size)) if size.iter().all(|side| (1..=16384).contains(side)) => Size::Pixels(size),
        (_, Some(size)) => {
            return Err(lines.wrong(line, format!("images.{name}.size is {size:?}; 1 to 16384 pixels are allowed")));
        }
        (scale, None) => match scale.unwrap_or(1.0) {
            share if (1.0 / 256.0..=4.0).contains(&share) => Size::Share(share),
            other => return Err(lines.wrong(line, format!("images.{name}.scale is {other}; 1/256 to 4 are allowed"))),
        },
    };
    Ok(OwnImage { format, size, mips: found.mips, history: found.history })
}

type Known<'a> = (&'a [Constant], &'a BTreeMap<String, OwnImage>);

fn pass(
    lines: &Lines<'_>,
    line: usize,
    (folder, texts): (&Path, &Texts),
    (constants, images): Known<'_>,
    found: FilePass,
) -> Result<Pass> {
    let wrong = |what: String| lines.wrong(line, what);
    let out = found.out.map(OneOrMore::list).unwrap_or_default();
    for name in &out {
        if name != PICTURE && !images.contains_key(name) && found.stage.as_deref() != Some("blur") {
            let known: Vec<&str> = [PICTURE].into_iter().chain(images.keys().map(String::as_str)).collect();
            return Err(wrong(format!("out names {name:?}, which is not declared; there are {}", known.join(", ")))
                .help(format!("Declare it: [images.{name}] with format = \"rgba16f\"")));
        }
    }
    if let Some(name) = out.iter().enumerate().find(|(at, name)| out[..*at].contains(name)).map(|(_, name)| name) {
        return Err(wrong(format!("out names {name:?} twice")));
    }
    let mut bind = BTreeMap::new();
    for (binding, source) in found.bind {
        let source = match source {
            FileSource::Name(image) => Source::plain(&image),
            FileSource::Full(full) => {
                let sampler = full.sampler.as_deref().unwrap_or("linear");
                let Some(sampler) = named(&SAMPLERS, sampler) else {
                    return Err(wrong(format!(
                        "bind.{binding}.sampler is {sampler:?}; there are {}",
                        names(&SAMPLERS)
                    )));
                };
                Source { image: full.image, sampler, mip: full.mip }
            }
        };
        bind.insert(binding, source);
    }
    let mut when = Vec::new();
    for condition in found.when.map(OneOrMore::list).unwrap_or_default() {
        let (name, on) = match condition.strip_prefix("not ") {
            Some(name) => (name.trim(), false),
            None => (condition.as_str(), true),
        };
        let switches: Vec<&str> = constants
            .iter()
            .filter(|constant| constant.default.is_boolean())
            .map(|constant| constant.name.as_str())
            .collect();
        if !switches.contains(&name) {
            return Err(wrong(format!("when names {name:?}, which is no switch; there are {}", listed(&switches)))
                .help(format!("Declare it: [constants.{name}] with default = true")));
        }
        when.push((name.to_owned(), on));
    }
    let mut values = Values::new();
    for (name, value) in &found.values {
        let value = json(value).ok_or_else(|| {
            wrong(format!("values.{name} is {value}; a number, true or false, or a list of 2 to 4 numbers is allowed"))
        })?;
        values.insert(name.clone(), value);
    }
    let (name, work) = match (&found.shader, found.stage.as_deref()) {
        (Some(shader), None) => {
            let program = program::compile(folder, shader, texts, &wrong)?;
            program.check(&bind, &out, &values, constants, &wrong)?;
            (
                Path::new(shader)
                    .file_stem()
                    .map_or_else(|| shader.clone(), |stem| stem.to_string_lossy().into_owned()),
                Work::Shader(program),
            )
        }
        (None, Some(stage)) => {
            if found.radius.is_some() && stage != "blur" {
                return Err(wrong(format!("stage {stage:?} has no radius")));
            }
            if let Some(name) = out.iter().find(|name| *name != PICTURE && !is_name(name)) {
                return Err(wrong(format!("{name:?} cannot name an image: letters, digits and _")));
            }
            if !values.is_empty() || !bind.is_empty() {
                return Err(wrong(format!(
                    "stage {stage:?} has neither bind nor values; it has image, out and radius"
                )));
            }
            let work = match stage {
                "mips" => Work::Mips,
                "scale" => Work::Scale,
                "blur" => Work::Blur(match &found.radius {
                    None => Number::Fixed(4.0),
                    Some(toml::Value::Integer(n)) if (1..=256).contains(n) => Number::Fixed(*n as f64),
                    Some(toml::Value::String(name))
                        if constants.iter().any(|c| c.name == *name && c.default.is_i64()) =>
                    {
                        Number::Constant(name.clone())
                    }
                    Some(other) => {
                        return Err(wrong(format!(
                            "radius is {other}; 1 to 256, or the name of a constant with a whole number"
                        )));
                    }
                }),
                other => return Err(wrong(format!("stage {other:?}; there are blur, mips, scale"))),
            };
            let Some(image) = &found.image else { return Err(wrong(format!("stage {stage:?} names no image"))) };
            let wanted = usize::from(stage != "mips");
            if out.len() != wanted {
                return Err(wrong(format!("stage {stage:?} has {wanted} out, found {}", out.len())));
            }
            bind.insert(String::new(), Source::plain(image));
            (stage.to_owned(), work)
        }
        _ => return Err(wrong("a pass has either shader or stage".into())),
    };
    if matches!(work, Work::Shader(_)) && (found.image.is_some() || found.radius.is_some()) {
        return Err(wrong("image and radius are for stages; a shader has bind and values".into()));
    }
    Ok(Pass { name: found.name.unwrap_or(name), line, work, bind, out, values, when })
}

pub(super) fn listed(names: &[&str]) -> String {
    if names.is_empty() { "none".into() } else { names.join(", ") }
}
