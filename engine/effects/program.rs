//! Shaders of pipelines: compiled from GLSL at run time, their interfaces read from the SPIR-V.

use std::{
    collections::BTreeMap,
    path::{Component, Path},
    sync::{Mutex, PoisonError},
};

use serde_json::Value;

use super::{
    Constant, Source, Values,
    file::{self, Texts},
};
use crate::{
    Error, Result,
    shader::{
        Access, Binding, BindingKind, Dim, Shader, SpecConstant, Stage, StageCode, Texel, compile,
        reflect::{self, Interface, Kind, Struct, Type},
    },
    shaders::{LIBRARY, types},
};

/// Push constants that every pass may have. `size`: of the target, pixels. `seconds`: time of the frame. `frame` and `seed`: those of the graph.
pub(super) const BUILT_IN: [&str; 4] = ["size", "seconds", "frame", "seed"];

/// Bytes of push constants that every device has.
const MOST_PUSH: u32 = 128;

/// A shader with what a pass must give to it.
#[derive(Clone, Debug)]
pub(super) struct Program {
    pub shader: &'static Shader,
    pub push: Option<Struct>,
    /// Values of the specialisation constants.
    pub spec: Vec<u32>,
    /// What the shader writes to each colour target.
    pub outputs: Vec<Texel>,
}

/// Shaders that were compiled, by the digest of their code. They stay for the whole program, because pipelines of devices refer to them.
static KNOWN: Mutex<BTreeMap<[u8; 32], &'static Shader>> = Mutex::new(BTreeMap::new());

/// Whether the engine has an include of this name.
pub(super) fn is_of_engine(name: &str) -> bool {
    LIBRARY.iter().any(|(known, _)| *known == name)
}

/// Compiles `folder/file`.
pub(super) fn compile(folder: &Path, file: &str, texts: &Texts, wrong: &dyn Fn(String) -> Error) -> Result<Program> {
    let (kind, stage) = match Path::new(file).extension().and_then(|extension| extension.to_str()) {
        Some("frag") => (shaderc::ShaderKind::Fragment, Stage::Fragment),
        Some("comp") => (shaderc::ShaderKind::Compute, Stage::Compute),
        _ => return Err(wrong(format!("shader {file:?}; a name that ends in .frag or .comp is allowed"))),
    };
    if Path::new(file).components().any(|part| !matches!(part, Component::Normal(_))) {
        return Err(wrong(format!("shader {file:?} must lie in the folder of the pipeline")));
    }
    let path = folder.join(file);
    let Some(source) = texts.get(&path) else { return Err(wrong(format!("shader {file:?} does not exist"))) };
    let failed = |text: String| {
        // The compiler names files as they were given to it: `path:line: error: …`.
        let lines: Vec<&str> =
            text.lines().filter(|line| !line.trim().is_empty() && !line.ends_with("generated.")).collect();
        let text = lines.join("; ").replace(&format!("{}:", path.display()), "line ");
        Error::input(text.strip_prefix("compilation error: ").unwrap_or(&text)).in_file(&path)
    };
    let include = |name: &str, from: &str| included(folder, name, from, texts);
    let named = path.display().to_string();
    let compiled = compile::compile_text((&named, &headed(source)), kind, (None, false), &include).map_err(failed)?;
    let interface = reflect::reflect(&compiled.reflect).map_err(failed)?;
    let shader = shader(file, stage, compiled.ship, &interface).map_err(failed)?;
    let spec = interface.spec.iter().map(|spec| spec.default).collect();
    let outputs = interface.outputs.iter().map(|(_, texel)| texel_of(texel)).collect();
    Ok(Program { shader, push: interface.push, spec, outputs })
}

/// The source with the lines that all shaders begin with, unless it has its own. Lines keep their numbers.
fn headed(source: &str) -> String {
    if source.lines().any(|line| line.trim_start().starts_with("#version")) {
        return source.to_owned();
    }
    let head = "#version 460\n#extension GL_EXT_scalar_block_layout : require\n#extension GL_GOOGLE_include_directive : require\n#line 1\n";
    format!("{head}{source}")
}

/// The name and the text of an include: a file beside the pipeline, or one of the engine's `lib/`.
fn included(folder: &Path, name: &str, from: &str, texts: &Texts) -> std::result::Result<(String, String), String> {
    if Path::new(name).components().any(|part| !matches!(part, Component::Normal(_))) {
        return Err(format!("#include \"{name}\": the path must stay inside the folder of the pipeline"));
    }
    let beside = folder.join(name);
    if let Some(text) = texts.get(&beside).filter(|_| !is_of_engine(from)) {
        return Ok((beside.display().to_string(), text.clone()));
    }
    match LIBRARY.iter().find(|(known, _)| *known == name) {
        Some((known, text)) => Ok(((*known).to_owned(), (*text).to_owned())),
        None => {
            let known: Vec<&str> = LIBRARY.iter().map(|(name, _)| *name).collect();
            Err(format!(
                "#include \"{name}\": no such file beside the pipeline or in the engine; the engine has {}",
                known.join(", ")
            ))
        }
    }
}

/// What all programs keep: leaked, because it lives as long as the program.
fn leaked(text: &str) -> &'static str {
    Box::leak(text.to_owned().into_boxed_str())
}

fn shader(
    file: &str,
    stage: Stage,
    code: Vec<u8>,
    interface: &Interface,
) -> std::result::Result<&'static Shader, String> {
    let members = interface.push.iter().flat_map(|push| &push.members);
    // Offsets need not ascend.
    let end = |member: &reflect::Member| u64::from(member.offset) + bytes_of(&member.ty);
    let push_size = u32::try_from(members.map(end).max().unwrap_or(0)).unwrap_or(u32::MAX);
    if push_size > MOST_PUSH {
        let allowed = "numbers and vectors within the first";
        return Err(format!(
            "push constants up to byte {push_size}, or of another type; allowed are {allowed} {MOST_PUSH} bytes"
        ));
    }
    if stage == Stage::Fragment && interface.color_outputs == 0 {
        return Err("it writes no colour: layout(location = 0) out vec4 NAME".into());
    }
    let even =
        interface.outputs.iter().zip(0..).all(|((location, texel), number)| *location == number && *texel != "None");
    if stage == Stage::Fragment && !even {
        return Err("its outputs must have the locations 0, 1, 2 … and be numbers or vectors of 32 bits".into());
    }
    let digest = *blake3::hash(&[code.as_slice(), format!("{file} {interface:?}").as_bytes()].concat()).as_bytes();
    let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(shader) = known.get(&digest) {
        return Ok(shader);
    }
    let bindings =
        interface.bindings.iter().map(|b| binding(b, stage, interface)).collect::<std::result::Result<Vec<_>, _>>()?;
    let own =
        StageCode { stage, file: leaked(&format!("effects.{file}.spv")), spirv: Box::leak(code.into_boxed_slice()) };
    let stages = match stage {
        Stage::Compute => vec![own],
        _ => vec![fullscreen()?, own],
    };
    let spec: Vec<SpecConstant> =
        interface.spec.iter().map(|spec| SpecConstant { name: leaked(&spec.name), id: spec.id }).collect();
    let shader: &'static Shader = Box::leak(Box::new(Shader {
        name: leaked(&format!("effects.{}", file.rsplit_once('.').map_or(file, |(stem, _)| stem))),
        stages: stages.leak(),
        bindings: bindings.leak(),
        push_size,
        workgroup: interface.workgroup,
        spec: spec.leak(),
        color_outputs: interface.color_outputs,
        ray_query: false,
        query: None,
    }));
    known.insert(digest, shader);
    Ok(shader)
}

/// Bytes of a push constant; more than any device has for types that constants do not have.
fn bytes_of(ty: &Type) -> u64 {
    match ty {
        Type::F32 | Type::I32 | Type::U32 => 4,
        Type::Vector(_, count) => 4 * u64::from(*count),
        _ => u64::from(MOST_PUSH) + 1,
    }
}

/// The vertex stage that covers the target: that of the engine's own passes.
fn fullscreen() -> std::result::Result<StageCode, String> {
    let stages = <crate::shaders::passes::skybox::Args as crate::graph::Args>::SHADER.stages;
    let vertex = stages.iter().find(|code| code.stage == Stage::Vertex).ok_or("the engine lost its vertex stage")?;
    Ok(StageCode { stage: Stage::Vertex, file: vertex.file, spirv: vertex.spirv })
}

fn texel_of(name: &str) -> Texel {
    match name {
        "Uint" => Texel::Uint,
        "Sint" => Texel::Sint,
        "None" => Texel::None,
        _ => Texel::Float,
    }
}

fn binding(found: &reflect::Binding, stage: Stage, interface: &Interface) -> std::result::Result<Binding, String> {
    let dim = |name: &str| match name {
        "D1" => Dim::D1,
        "D2" => Dim::D2,
        "D2Array" => Dim::D2Array,
        "D3" => Dim::D3,
        "Cube" => Dim::Cube,
        _ => Dim::CubeArray,
    };
    let allowed = "a pass may bind sampler2D, image2D and the uniform block of `View`";
    let name = &found.name;
    let kind = match &found.kind {
        Kind::Sampled(of) if *of == "D2" || *of == "D2Array" => BindingKind::Sampled(dim(of)),
        Kind::Storage("D2") if stage != Stage::Compute => {
            return Err(format!("{name} is a storage image, which only a .comp may write"));
        }
        Kind::Storage("D2") if found.access != reflect::Access::Write => {
            return Err(format!(
                "{name} is read: a pass writes its storage images alone. Declare it writeonly, and read through a sampler2D"
            ));
        }
        Kind::Storage("D2") => BindingKind::Storage(Dim::D2),
        Kind::Uniform(of) if of == "View" => {
            let size = interface
                .structs
                .iter()
                .find(|s| s.name == *of)
                .map_or(0, |s| reflect::struct_size(s, &interface.structs));
            if size as usize != size_of::<types::View>() {
                return Err(format!("{name}: View is that of \"lib/view.glsl\", in a block with scalar layout"));
            }
            BindingKind::Uniform { size }
        }
        Kind::Uniform(of) => {
            return Err(format!("{name} is a uniform block of {of}; {allowed}. Constants are push constants"));
        }
        Kind::Buffer => return Err(format!("{name} is a storage buffer; {allowed}")),
        Kind::AccelerationStructure => return Err(format!("{name} is an acceleration structure; {allowed}")),
        Kind::Sampled(of) | Kind::Storage(of) => return Err(format!("{name} has the shape {of}; {allowed}")),
    };
    if found.compares {
        return Err(format!("{name} compares depths, or reads single samples; {allowed}"));
    }
    if found.count != 1 {
        return Err(format!("{name} is an array of {} resources; {allowed}", found.count));
    }
    Ok(Binding {
        name: leaked(name),
        binding: found.binding,
        kind,
        access: match found.access {
            reflect::Access::Read => Access::Read,
            reflect::Access::Write => Access::Write,
            reflect::Access::ReadWrite => Access::ReadWrite,
        },
        stages: if stage == Stage::Compute { &[Stage::Compute] } else { &[Stage::Fragment] },
        count: 1,
        texel: texel_of(found.texel),
        format: found.format,
    })
}

impl Program {
    /// Checks what the file says of a pass against the interface of its shader.
    pub fn check(
        &self,
        bind: &BTreeMap<String, Source>,
        out: &[String],
        values: &Values,
        constants: &[Constant],
        wrong: &dyn Fn(String) -> Error,
    ) -> Result<()> {
        let sampled = self.shader.bindings.iter().filter(|binding| matches!(binding.kind, BindingKind::Sampled(_)));
        let bindings: Vec<&str> = sampled.map(|binding| binding.name).collect();
        if let Some(name) = bind.keys().find(|name| !bindings.contains(&name.as_str())) {
            return Err(wrong(format!(
                "bind.{name}: the shader has no such sampler; it has {}",
                file::listed(&bindings)
            )));
        }
        let written = match self.shader.stages.last().map(|code| code.stage) {
            Some(Stage::Fragment) => self.shader.color_outputs as usize,
            _ => self.storage().count(),
        };
        if written == 0 {
            return Err(wrong(
                "the shader writes no image: layout(binding = N, FORMAT) uniform writeonly image2D NAME".into(),
            ));
        }
        if out.len() != written {
            let what = format!("out names {} images; the shader writes {written}", out.len());
            return Err(wrong(what));
        }
        let members: Vec<&str> =
            self.push.iter().flat_map(|push| &push.members).map(|member| member.name.as_str()).collect();
        if let Some(name) = values.keys().find(|name| !members.contains(&name.as_str())) {
            return Err(wrong(format!(
                "values.{name}: the shader has no such push constant; it has {}",
                file::listed(&members)
            )));
        }
        for member in self.push.iter().flat_map(|push| &push.members) {
            let constant = constants.iter().find(|constant| constant.name == member.name);
            let value = values.get(&member.name).or(constant.map(|constant| &constant.default));
            match value {
                Some(value) if bits(&member.ty, value).is_some() => (),
                Some(value) => {
                    let what = format!(
                        "the push constant {} is {}, and {value} does not fit into it",
                        member.name,
                        spelled(&member.ty)
                    );
                    return Err(wrong(what));
                }
                None if built_in(&member.name, &member.ty) => (),
                None => {
                    let known: Vec<&str> = constants.iter().map(|constant| constant.name.as_str()).collect();
                    let what = format!(
                        "the push constant {} ({}) is no constant of the pipeline; there are {}, and the engine's vec2 size, float seconds, uint frame, uint seed",
                        member.name,
                        spelled(&member.ty),
                        file::listed(&known)
                    );
                    return Err(wrong(what));
                }
            }
        }
        Ok(())
    }

    /// The storage images, which a compute shader writes.
    pub fn storage(&self) -> impl Iterator<Item = &'static Binding> + '_ {
        self.shader.bindings.iter().filter(|binding| matches!(binding.kind, BindingKind::Storage(_)))
    }
}

fn built_in(name: &str, ty: &Type) -> bool {
    match name {
        "size" => *ty == Type::Vector(Box::new(Type::F32), 2),
        "seconds" => *ty == Type::F32,
        "frame" | "seed" => *ty == Type::U32,
        _ => false,
    }
}

fn spelled(ty: &Type) -> String {
    match ty {
        Type::F32 => "float".into(),
        Type::I32 => "int".into(),
        Type::U32 => "uint".into(),
        Type::Vector(of, count) => match **of {
            Type::F32 => format!("vec{count}"),
            Type::I32 => format!("ivec{count}"),
            _ => format!("uvec{count}"),
        },
        other => format!("{other:?}"),
    }
}

/// The words of a push constant; `None` if the value does not fit into its type.
pub(super) fn bits(ty: &Type, value: &Value) -> Option<Vec<u32>> {
    match (ty, value) {
        (Type::F32, Value::Number(n)) => Some(vec![(n.as_f64()? as f32).to_bits()]),
        (Type::I32, Value::Number(n)) => Some(vec![i32::try_from(n.as_i64()?).ok()? as u32]),
        (Type::U32, Value::Number(n)) => Some(vec![u32::try_from(n.as_i64()?).ok()?]),
        (Type::U32, Value::Bool(on)) => Some(vec![u32::from(*on)]),
        (Type::Vector(of, count), Value::Array(list)) if list.len() == *count as usize => {
            let whole = |value: &Value| match value.as_f64() {
                Some(n) if **of != Type::F32 && n.fract() == 0.0 => Value::from(n as i64),
                _ => value.clone(),
            };
            list.iter().map(|value| bits(of, &whole(value)).map(|words| words[0])).collect()
        }
        _ => None,
    }
}
