//! The passes of a pipeline in a graph.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;

use super::{
    Number, OwnImage, PICTURE, Pass, Pipeline, Size, Source, Values, Work,
    program::{Program, bits},
};
use crate::{
    Error, Result,
    graph::{Bind, Class, Extent, Format, Graph, Image, ImageDesc, Load, Targets, Uniform},
    passes::blur,
    scene::View,
    shader::{BindingKind, Stage, Texel},
    shaders::types,
};

/// The images of a frame, by the names that passes use.
struct Images<'p> {
    pipeline: &'p Pipeline,
    picture: Image,
    own: BTreeMap<String, Image>,
    before: BTreeMap<String, Image>,
    written: BTreeSet<String>,
    /// Those whose smaller levels are made.
    levels: BTreeSet<String>,
    /// Those of the technique, which passes can read.
    graph: BTreeSet<String>,
}

impl Pipeline {
    /// Declares the passes whose switches are on, after a technique whose picture is `picture`. Returns the picture after the last one. `values`: of the
    /// constants that are not at their defaults.
    ///
    /// # Errors
    /// `Usage` for wrong values; `Input`, naming file and line, for a pass that reads an image which is not there.
    pub fn frame(
        &self,
        graph: &mut Graph,
        picture: Image,
        view: &View,
        seconds: f64,
        values: &Values,
    ) -> Result<Image> {
        self.check(values)?;
        let mut all = self.defaults();
        all.extend(values.clone());
        let on = |pass: &&Pass| pass.when.iter().all(|(name, on)| all.get(name).and_then(Value::as_bool) == Some(*on));
        let passes: Vec<&Pass> = self.passes.iter().filter(on).collect();
        if passes.is_empty() {
            return Ok(picture);
        }
        let mut images = Images {
            pipeline: self,
            picture,
            own: BTreeMap::new(),
            before: BTreeMap::new(),
            written: BTreeSet::new(),
            levels: BTreeSet::new(),
            graph: graph.image_names().into_iter().map(str::to_owned).collect(),
        };
        images.declare(graph, &passes);
        let uniform = graph.uniform(&view.uniform());
        let moment = Moment { all: &all, seconds, view: uniform };
        let declared =
            graph.scope("effects", |graph| passes.iter().try_for_each(|pass| images.pass(graph, pass, &moment)));
        declared?;
        Ok(images.picture)
    }

    fn wrong(&self, line: usize, what: String) -> Error {
        Error::input(what).at(format!("line {line}")).in_file(&self.path)
    }
}

/// What all passes of a frame know.
struct Moment<'a> {
    all: &'a Values,
    seconds: f64,
    view: Uniform<types::View>,
}

impl Images<'_> {
    /// Declares the images that a pass writes.
    fn declare(&mut self, graph: &mut Graph, passes: &[&Pass]) {
        let whole = graph.extent(self.picture);
        let used = |name: &String| passes.iter().any(|pass| pass.out.contains(name));
        for (name, image) in self.pipeline.images.iter().filter(|(name, _)| used(name)) {
            let extent = extent(image, whole);
            let mips = if image.mips { extent.width.max(extent.height).ilog2() + 1 } else { 1 };
            let desc = ImageDesc::new(image.format, extent).mips(mips);
            let named = format!("effects.{name}");
            let handle = match image.history {
                true => {
                    let (before, now) = graph.history_with(named, desc);
                    self.before.insert(format!("{name}.previous"), before);
                    now
                }
                false => graph.image_with(named, desc),
            };
            self.own.insert(name.clone(), handle);
        }
    }

    /// The image that a pass reads.
    fn read(&self, graph: &Graph, pass: &Pass, source: &Source) -> Result<Image> {
        let name = source.image.as_str();
        let image = if name == PICTURE {
            self.picture
        } else if let Some(before) = self.before.get(name) {
            *before
        } else if self.pipeline.images.contains_key(name.strip_suffix(".previous").unwrap_or(name))
            && !self.own.contains_key(name)
        {
            let what = format!("pass {:?} reads the image {name:?}, but no pass that runs writes it", pass.name);
            return Err(self.pipeline.wrong(pass.line, what));
        } else if let Some(own) = self.own.get(name) {
            if !self.written.contains(name) {
                let what =
                    format!("pass {:?} reads the image {name:?}, but no pass before it that runs writes it", pass.name);
                return Err(self.pipeline.wrong(pass.line, what));
            }
            if self.levels.contains(name) { *own } else { own.mip(0) }
        } else if let Some(found) = graph.find_image(name).filter(|_| self.graph.contains(name)) {
            found
        } else {
            let own = [PICTURE]
                .into_iter()
                .chain(self.own.keys().map(String::as_str))
                .chain(self.before.keys().map(String::as_str));
            let known: Vec<&str> = own.chain(self.graph.iter().map(String::as_str)).collect();
            let what = format!(
                "pass {:?} reads the image {name:?}, which is not there; there are {}",
                pass.name,
                known.join(", ")
            );
            return Err(self.pipeline.wrong(pass.line, what));
        };
        let all = graph.desc(image).mips;
        let image = match source.mip {
            // A small picture has fewer levels.
            Some(mip) if self.levels.contains(name) => image.mip(mip.min(all - 1)),
            Some(mip) if mip >= all => {
                let what =
                    format!("pass {:?} reads level {mip} of {name:?}, which has levels 0 to {}", pass.name, all - 1);
                return Err(self.pipeline.wrong(pass.line, what));
            }
            Some(mip) => image.mip(mip),
            None => image,
        };
        Ok(image.sampled_by(source.sampler))
    }

    /// The image that a pass writes: a new one for the picture.
    fn written(&mut self, graph: &mut Graph, pass: &Pass, name: &str) -> Result<Image> {
        if name == PICTURE {
            let desc = graph.desc(self.picture);
            return Ok(graph.image("effects.picture", desc.format, desc.extent));
        }
        match self.own.get(name) {
            Some(image) => Ok(image.mip(0)),
            None => Err(self.pipeline.wrong(pass.line, format!("out names {name:?}, which is not declared"))),
        }
    }

    /// Later passes read what was written.
    fn done(&mut self, name: &str, image: Image) {
        match name {
            PICTURE => self.picture = image,
            _ => {
                self.written.insert(name.to_owned());
                self.own.entry(name.to_owned()).or_insert(image);
            }
        }
    }

    fn pass(&mut self, graph: &mut Graph, pass: &Pass, moment: &Moment<'_>) -> Result<()> {
        let source = || pass.bind.get("").cloned().unwrap_or_else(|| Source::plain(PICTURE));
        match &pass.work {
            Work::Shader(program) => return self.shader(graph, pass, program, moment),
            Work::Mips => {
                let name = source().image;
                self.read(graph, pass, &source())?;
                let Some(image) =
                    self.own.get(&name).filter(|_| self.pipeline.images.get(&name).is_some_and(|of| of.mips))
                else {
                    let what = format!("pass {:?} makes levels of {name:?}, which has only one", pass.name);
                    return Err(self
                        .pipeline
                        .wrong(pass.line, what)
                        .help("Declare it: [images.NAME] with mips = true"));
                };
                graph.mips(*image);
                self.levels.insert(name);
            }
            Work::Blur(radius) => {
                let image = self.read(graph, pass, &source())?;
                let radius = match radius {
                    Number::Fixed(radius) => *radius,
                    Number::Constant(name) => moment.all.get(name).and_then(Value::as_f64).unwrap_or(1.0),
                };
                if graph.desc(image).format.class() != Class::Float {
                    let what = format!("pass {:?} blurs {:?}, whose values are no floats", pass.name, source().image);
                    return Err(self.pipeline.wrong(pass.line, what));
                }
                let blurred = graph.scope(pass.name.clone(), |graph| {
                    blur::gaussian(graph, image.mip(0), (radius as u32).clamp(1, 256))
                });
                let name = &pass.out[0];
                if name == PICTURE || self.pipeline.images.contains_key(name) {
                    let out = self.written(graph, pass, name)?;
                    graph.blit(blurred, out);
                    self.done(name, out);
                } else {
                    self.own.insert(name.clone(), blurred);
                    self.written.insert(name.clone());
                }
            }
            Work::Scale => {
                let image = self.read(graph, pass, &source())?;
                let out = self.written(graph, pass, &pass.out[0])?;
                graph.blit(image.mip(0), out).named(pass.name.clone());
                self.done(&pass.out[0], out);
            }
        }
        Ok(())
    }

    fn shader(&mut self, graph: &mut Graph, pass: &Pass, program: &Program, moment: &Moment<'_>) -> Result<()> {
        let mut out = Vec::new();
        for name in &pass.out {
            out.push(self.written(graph, pass, name)?);
        }
        let size = out.first().map_or(Extent::square(1), |image| graph.extent(*image));
        if let Some(at) = out.iter().position(|image| graph.extent(*image) != size) {
            let what = format!(
                "pass {:?} writes {:?} and {:?}, which have different sizes",
                pass.name, pass.out[0], pass.out[at]
            );
            return Err(self.pipeline.wrong(pass.line, what));
        }
        for ((image, name), written) in out.iter().zip(&pass.out).zip(&program.outputs) {
            if texel(graph, *image) != *written {
                let found = texel(graph, *image);
                let what = format!("pass {:?} writes {written:?} to {name:?}, whose values are {found:?}", pass.name);
                return Err(self
                    .pipeline
                    .wrong(pass.line, what)
                    .help("vec4 is for floats, uvec4 and ivec4 for integers"));
            }
        }
        let mut storage = out.iter();
        let mut resources = Vec::new();
        for binding in program.shader.bindings {
            resources.push(match binding.kind {
                BindingKind::Uniform { .. } => Bind::Uniform(moment.view.into()),
                BindingKind::Storage(_) => match storage.next() {
                    Some(image) => {
                        let named = Format::from_spirv(binding.format);
                        let found = graph.desc(*image).format;
                        if named.is_some_and(|named| named != found) {
                            let what = format!("pass {:?}: the shader writes {} as {named:?}, but the image is {found:?}", pass.name, binding.name);
                            return Err(self.pipeline.wrong(pass.line, what));
                        }
                        Bind::Image(*image)
                    }
                    None => return Err(self.pipeline.wrong(pass.line, format!("no out for {}", binding.name))),
                },
                _ => {
                    let source = pass.bind.get(binding.name).cloned().unwrap_or_else(|| self.by_name(binding.name));
                    let image = self.read(graph, pass, &source)?;
                    if let Some(own) = pass.out.iter().find(|own| **own == source.image && *own != PICTURE) {
                        let what = format!("pass {:?} reads and writes {own:?}", pass.name);
                        let help = "Write another image, or declare it with history = true and read the one of the frame before, NAME.previous";
                        return Err(self.pipeline.wrong(pass.line, what).help(help));
                    }
                    let of = texel(graph, image);
                    if of != binding.texel {
                        let what = format!("pass {:?}: {} reads {:?} by a sampler of {:?}, but its values are {of:?}", pass.name, binding.name, source.image, binding.texel);
                        return Err(self.pipeline.wrong(pass.line, what).help("sampler2D is for floats, usampler2D and isampler2D for integers"));
                    }
                    Bind::Image(image)
                }
            });
        }
        let push = push(graph, pass, program, moment, size)?;
        let spec = program.spec.clone();
        let name = pass.name.clone();
        if program.shader.stages.last().is_some_and(|code| code.stage == Stage::Fragment) {
            let targets = out.iter().fold(Targets::new(), |targets, image| targets.color(*image, Load::Discard));
            graph.draw_over(program.shader, targets, resources, (push, spec)).named(name);
        } else {
            graph.dispatch(program.shader, resources, (push, spec), size).named(name);
        }
        for (name, image) in pass.out.iter().zip(out) {
            self.done(name, image);
        }
        Ok(())
    }

    /// The image of a binding that the file does not name: of the same name, where an underscore may stand for a dot.
    fn by_name(&self, binding: &str) -> Source {
        let known = |name: &str| {
            name == PICTURE
                || self.own.contains_key(name)
                || self.before.contains_key(name)
                || self.graph.contains(name)
        };
        let dotted = binding.replace('_', ".");
        let last = binding.rsplit_once('_').map(|(front, last)| format!("{front}.{last}"));
        let found = [Some(binding.to_owned()), last, Some(dotted)].into_iter().flatten().find(|name| known(name));
        Source::plain(&found.unwrap_or_else(|| binding.to_owned()))
    }
}

/// What the values of an image are to a shader.
fn texel(graph: &Graph, image: Image) -> Texel {
    match graph.desc(image).format.class() {
        Class::Uint => Texel::Uint,
        Class::Sint => Texel::Sint,
        _ => Texel::Float,
    }
}

fn extent(image: &OwnImage, whole: Extent) -> Extent {
    match image.size {
        Size::Pixels([width, height]) => Extent::new(width, height),
        Size::Share(share) => {
            let side = |pixels: u32| ((f64::from(pixels) * share).ceil() as u32).clamp(1, 16384);
            Extent::new(side(whole.width), side(whole.height))
        }
    }
}

/// The bytes of the push constants of a pass.
fn push(graph: &Graph, pass: &Pass, program: &Program, moment: &Moment<'_>, size: Extent) -> Result<Vec<u8>> {
    let mut bytes = vec![0u8; program.shader.push_size as usize];
    for member in program.push.iter().flat_map(|push| &push.members) {
        let value = pass.values.get(&member.name).or_else(|| moment.all.get(&member.name));
        let words = match value {
            Some(value) => bits(&member.ty, value).ok_or_else(|| {
                let what = format!("{value} does not fit into the push constant of pass {:?}", pass.name);
                Error::usage(what).at(&member.name)
            })?,
            None => match member.name.as_str() {
                "size" => vec![(size.width as f32).to_bits(), (size.height as f32).to_bits()],
                "seconds" => vec![(moment.seconds as f32).to_bits()],
                "frame" => vec![graph.frame],
                _ => vec![graph.seed],
            },
        };
        for (index, word) in words.iter().enumerate() {
            let at = member.offset as usize + 4 * index;
            if let Some(to) = bytes.get_mut(at..at + 4) {
                to.copy_from_slice(&word.to_le_bytes());
            }
        }
    }
    Ok(bytes)
}
