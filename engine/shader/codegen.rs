//! Writes the Rust modules and the plain-text listing of all shader interfaces.

use super::{
    reflect::{Interface, Kind, Spec, Struct, Type, size_of, struct_size},
    variants::{Merged, check_variants, merge, unite},
};
use std::{collections::BTreeMap, fmt::Write};

/// One stage of a pass, as compiled.
#[derive(Debug)]
pub struct Stage {
    /// `Compute`, `Vertex` or `Fragment`.
    pub stage: &'static str,
    pub interface: Interface,
    /// Absolute path of the optimised SPIR-V.
    pub spirv: String,
    /// The same stage, tracing by ray query: interface and path. Only stages that trace have it.
    pub query: Option<(Interface, String)>,
}

impl Stage {
    /// Interface and path in the variant that traces by ray query, or not.
    pub fn variant(&self, query: bool) -> (&Interface, &str) {
        match &self.query {
            Some((interface, spirv)) if query => (interface, spirv),
            _ => (&self.interface, &self.spirv),
        }
    }
}

/// One pass: module `folder::stem`.
#[derive(Debug)]
pub struct Pass {
    pub folder: String,
    pub stem: String,
    pub stages: Vec<Stage>,
}

/// A constant that a library file exports: name, Rust type, value.
pub type Export = (String, &'static str, String);

/// What `build.rs` writes: Rust text and the listing.
#[derive(Debug)]
pub struct Generated {
    pub rust: String,
    #[allow(dead_code)] // read by build.rs only
    pub listing: String,
}

fn rust_type(ty: &Type, types: &str) -> String {
    match ty {
        Type::F32 => "f32".into(),
        Type::I32 => "i32".into(),
        Type::U32 => "u32".into(),
        Type::Vector(of, n) | Type::Array(of, n) => format!("[{}; {n}]", rust_type(of, types)),
        Type::Matrix { rows, columns } => format!("[[f32; {rows}]; {columns}]"),
        Type::Struct(name) => format!("{types}{name}"),
    }
}

fn write_struct(out: &mut String, s: &Struct, structs: &[Struct], indent: &str, types: &str) {
    let size = struct_size(s, structs);
    let _ = writeln!(
        out,
        "{indent}/// {size} bytes, scalar layout.\n{indent}#[repr(C)]\n{indent}#[derive(Clone, Copy, Debug, PartialEq, \
         ::bytemuck::Pod, ::bytemuck::Zeroable)]\n{indent}pub struct {} {{",
        s.name
    );
    for m in &s.members {
        let _ = writeln!(out, "{indent}    pub {}: {},", m.name, rust_type(&m.ty, types));
    }
    let _ = writeln!(out, "{indent}}}");
    let name = &s.name;
    let _ = writeln!(
        out,
        "{indent}impl Default for {name} {{ fn default() -> Self {{ ::bytemuck::Zeroable::zeroed() }} }}"
    );
    for m in &s.members {
        let _ = writeln!(
            out,
            "{indent}const _: () = assert!(::core::mem::offset_of!({name}, {}) == {});",
            m.name, m.offset
        );
    }
    let _ = writeln!(out, "{indent}const _: () = assert!(::core::mem::size_of::<{name}>() == {size});");
}

fn one<'a, T: PartialEq>(
    pass: &'a Pass,
    get: impl Fn(&'a Interface) -> Option<&'a T>,
    what: &str,
) -> Result<Option<&'a T>, String> {
    let mut found: Option<&T> = None;
    for value in pass.stages.iter().filter_map(|s| get(&s.interface)) {
        match found {
            Some(other) if other != value => {
                return Err(format!("the stages declare different {what}; share it by an include"));
            }
            _ => found = Some(value),
        }
    }
    Ok(found)
}

fn write_pass(out: &mut String, listing: &mut String, pass: &Pass, structs: &[Struct]) -> Result<(), String> {
    let name = format!("{}.{}", pass.folder, pass.stem);
    check_variants(pass)?;
    let bindings = merge(pass, false)?;
    let two = pass.stages.iter().any(|s| s.query.is_some());
    let query = if two { merge(pass, true)? } else { Vec::new() };
    let fields = unite(&bindings, &query)?;
    let traced =
        fields.iter().find(|f| !f.compute && f.binding.kind == Kind::AccelerationStructure && f.binding.count == 1);
    if two && traced.is_none() {
        return Err("the variant that traces by ray query binds no acceleration structure of its own".into());
    }
    let push = one(pass, |i| i.push.as_ref(), "push constants")?;
    let empty = Vec::new();
    let spec: &Vec<Spec> =
        one(pass, |i| (!i.spec.is_empty()).then_some(&i.spec), "specialisation constants")?.unwrap_or(&empty);
    let compute = pass.stages[0].stage == "Compute";
    let workgroup = pass.stages[0].interface.workgroup;
    let outputs = pass.stages.iter().find(|s| s.stage == "Fragment").map_or(0, |s| s.interface.color_outputs);
    let push_size = push.map_or(0, |p| struct_size(p, structs));
    if push_size > 128 {
        return Err(format!(
            "{push_size} bytes of push constants; 128 is the most that every device offers. Use a uniform block"
        ));
    }

    let file = if compute { "comp" } else { "vert, .frag" };
    let _ = writeln!(out, "    /// `shaders-glsl/{}/{}` (.{file})", pass.folder, pass.stem);
    let _ = writeln!(out, "    pub mod {} {{", pass.stem);
    let _ = writeln!(
        listing,
        "{name}{}",
        if compute { format!("  workgroup {workgroup:?}") } else { format!("  raster, {outputs} colours") }
            + if two { ", in compute and by ray query" } else { "" }
    );
    if compute {
        let _ = writeln!(
            out,
            "        /// Threads of a workgroup.\n        pub const WORKGROUP: [u32; 3] = {workgroup:?};"
        );
    }
    if let Some(push) = push {
        write_struct(out, push, structs, "        ", "super::super::types::");
    }
    if !spec.is_empty() {
        let _ = writeln!(
            out,
            "        /// Specialisation constants; the defaults are the shader's.\n        #[derive(Clone, Copy, Debug, PartialEq)]\n        pub struct Spec {{"
        );
        for s in spec {
            let _ = writeln!(out, "            pub {}: {},", s.name, rust_type(&s.ty, ""));
        }
        let _ = writeln!(
            out,
            "        }}\n        impl Default for Spec {{\n            fn default() -> Self {{\n                Self {{"
        );
        for s in spec {
            let value = match s.ty {
                Type::F32 => format!("f32::from_bits({})", s.default),
                Type::I32 => format!("{}", s.default as i32),
                _ => format!("{}", s.default),
            };
            let _ = writeln!(out, "                    {}: {value},", s.name);
            let _ = writeln!(listing, "    spec {} {} = {}", s.id, s.name, s.default);
        }
        let _ = writeln!(out, "                }}\n            }}\n        }}");
    }

    let _ = writeln!(
        out,
        "        /// Everything `{name}` binds.\n        #[derive(Clone, Copy, Debug)]\n        pub struct Args {{"
    );
    for m in &fields {
        let b = m.binding;
        let ty = match &b.kind {
            Kind::Sampled(_) | Kind::Storage(_) => "crate::graph::Image".to_owned(),
            Kind::Buffer => "crate::graph::Buffer".to_owned(),
            Kind::AccelerationStructure => "crate::graph::Accel".to_owned(),
            Kind::Uniform(s) => format!("crate::graph::Uniform<super::super::types::{s}>"),
        };
        let ty = if b.count > 1 { format!("[{ty}; {}]", b.count) } else { ty };
        let _ = writeln!(out, "            pub {}: {ty},", b.name);
        let kind = match &b.kind {
            Kind::Sampled(d) => format!("sampled {d}"),
            Kind::Storage(d) => format!("storage {d}"),
            Kind::Buffer => "buffer".into(),
            Kind::Uniform(s) => format!("uniform {s}"),
            Kind::AccelerationStructure => "acceleration structure".into(),
        };
        let count = if b.count > 1 { format!(" × {}", b.count) } else { String::new() };
        let only = match (two, m.compute, m.query) {
            (true, true, false) => ", only in compute",
            (true, false, true) => ", only by ray query",
            _ => "",
        };
        let _ = writeln!(listing, "    {:2} {}: {kind}{count}, {:?}{only}", b.binding, b.name, m.access);
    }
    if let Some(push) = push {
        let _ = writeln!(out, "            pub push: Push,");
        for m in &push.members {
            let _ = writeln!(listing, "    push {:3} {}: {}", m.offset, m.name, rust_type(&m.ty, ""));
        }
    }
    if !spec.is_empty() {
        let _ = writeln!(out, "            pub spec: Spec,");
    }
    let _ = writeln!(out, "        }}\n");

    let mut shader = Written {
        pass,
        name: name.clone(),
        bindings: &bindings,
        spec,
        push_size,
        workgroup,
        outputs,
        structs,
        query: false,
    };
    shader.write(out, if two { "Some(&QUERY)" } else { "None" });
    if two {
        shader = Written { name: format!("{name} (ray query)"), bindings: &query, query: true, ..shader };
        shader.write(out, "None");
    }

    let _ = writeln!(
        out,
        "        impl crate::graph::Args for Args {{\n            const SHADER: &'static crate::shader::Shader = &SHADER;"
    );
    let unused = if bindings.is_empty() { "_out" } else { "out" };
    let _ = writeln!(out, "            fn resources(&self, {unused}: &mut Vec<crate::graph::Bind>) {{");
    write_resources(out, &bindings);
    let _ = writeln!(out, "            }}");
    if let Some(traced) = traced {
        let _ = writeln!(
            out,
            "            fn variant(&self, out: &mut Vec<crate::graph::Bind>) -> &'static crate::shader::Shader {{\n                \
             if self.{}.is_none() {{\n                    crate::graph::Args::resources(self, out);\n                    return &SHADER;\n                }}",
            traced.binding.name
        );
        write_resources(out, &query);
        let _ = writeln!(out, "                &QUERY\n            }}");
    }
    if push.is_some() {
        let _ = writeln!(out, "            fn push(&self) -> &[u8] {{ ::bytemuck::bytes_of(&self.push) }}");
    }
    if !spec.is_empty() {
        let list: Vec<String> = spec
            .iter()
            .map(|s| match s.ty {
                Type::F32 => format!("self.spec.{}.to_bits()", s.name),
                Type::I32 => format!("self.spec.{} as u32", s.name),
                _ => format!("self.spec.{}", s.name),
            })
            .collect();
        let _ = writeln!(out, "            fn spec(&self) -> Vec<u32> {{ vec![{}] }}", list.join(", "));
    }
    let which = if compute { "ComputeArgs" } else { "RasterArgs" };
    let _ = writeln!(out, "        }}\n        impl crate::graph::{which} for Args {{}}");
    if let (true, Some([first, count])) = (compute, push.and_then(range)) {
        let _ = writeln!(
            out,
            "        impl crate::graph::RangedArgs for Args {{ const RANGE: [usize; 2] = [{first}, {count}]; }}"
        );
    }
    let _ = writeln!(out, "    }}");
    Ok(())
}

/// Byte offsets of the members `first` and `count` of push constants, if both are unsigned integers.
fn range(push: &Struct) -> Option<[u32; 2]> {
    let offset = |name| push.members.iter().find(|m| m.name == name && m.ty == Type::U32).map(|m| m.offset);
    Some([offset("first")?, offset("count")?])
}

/// Pushes the resources of these bindings.
fn write_resources(out: &mut String, bindings: &[Merged]) {
    for m in bindings {
        let b = m.binding;
        let variant = match &b.kind {
            Kind::Sampled(_) | Kind::Storage(_) => "Image",
            Kind::Buffer => "Buffer",
            Kind::AccelerationStructure => "Accel",
            Kind::Uniform(_) => "Uniform",
        };
        let convert = if variant == "Uniform" { ".into()" } else { "" };
        if b.count > 1 {
            let _ = writeln!(
                out,
                "                out.extend(self.{}.iter().map(|r| crate::graph::Bind::{variant}(*r)));",
                b.name
            );
        } else {
            let _ = writeln!(out, "                out.push(crate::graph::Bind::{variant}(self.{}{convert}));", b.name);
        }
    }
}

/// The last part of a path.
fn file_name(path: &str) -> &str {
    path.rsplit('/').next().unwrap_or(path)
}

/// One variant of a pass, as a `Shader`.
struct Written<'a> {
    pass: &'a Pass,
    name: String,
    bindings: &'a [Merged<'a>],
    spec: &'a [Spec],
    push_size: u32,
    workgroup: [u32; 3],
    outputs: u32,
    structs: &'a [Struct],
    /// The one that traces by ray query.
    query: bool,
}

impl Written<'_> {
    fn write(&self, out: &mut String, other: &str) {
        let Self { pass, name, bindings, spec, push_size, workgroup, outputs, structs, query } = self;
        let (doc, item) =
            if *query { ("The same, tracing by ray query", "QUERY") } else { ("Code and interface", "SHADER") };
        let _ = writeln!(
            out,
            "        /// {doc}.\n        pub static {item}: crate::shader::Shader = crate::shader::Shader {{\n            name: {name:?},\n            stages: &["
        );
        for s in &pass.stages {
            let _ = writeln!(
                out,
                "                crate::shader::StageCode {{ stage: crate::shader::Stage::{}, file: {:?}, spirv: include_bytes!({:?}) }},",
                s.stage,
                file_name(s.variant(*query).1),
                s.variant(*query).1
            );
        }
        let _ = writeln!(out, "            ],\n            bindings: &[");
        for m in *bindings {
            let b = m.binding;
            let kind = match &b.kind {
                Kind::Sampled(d) => format!("Sampled(crate::shader::Dim::{d})"),
                Kind::Storage(d) => format!("Storage(crate::shader::Dim::{d})"),
                Kind::Buffer => "Buffer".into(),
                Kind::Uniform(s) => format!("Uniform {{ size: {} }}", size_of(&Type::Struct(s.clone()), structs)),
                Kind::AccelerationStructure => "AccelerationStructure".into(),
            };
            let stages: Vec<String> = m.stages.iter().map(|s| format!("crate::shader::Stage::{s}")).collect();
            let _ = writeln!(
                out,
                "                crate::shader::Binding {{ name: {:?}, binding: {}, kind: crate::shader::BindingKind::{kind}, access: \
                 crate::shader::Access::{:?}, stages: &[{}], count: {}, texel: crate::shader::Texel::{}, format: {} }},",
                b.name,
                b.binding,
                m.access,
                stages.join(", "),
                b.count,
                b.texel,
                b.format
            );
        }
        let _ = writeln!(
            out,
            "            ],\n            push_size: {push_size},\n            workgroup: {workgroup:?},\n            spec: &["
        );
        for s in *spec {
            let _ =
                writeln!(out, "                crate::shader::SpecConstant {{ name: {:?}, id: {} }},", s.name, s.id);
        }
        let ray_query = pass.stages.iter().any(|s| s.variant(*query).0.ray_query);
        let _ = writeln!(
            out,
            "            ],\n            color_outputs: {outputs},\n            ray_query: {ray_query},\n            query: {other},\n        }};\n"
        );
    }
}

/// Generates everything for `passes`, which are sorted by folder and stem.
///
/// # Errors
/// What does not fit together, with the shader's name in front.
pub fn generate(passes: &[Pass], exports: &[Export]) -> Result<Generated, String> {
    let mut structs: Vec<Struct> = Vec::new();
    let mut owner: BTreeMap<String, String> = BTreeMap::new();
    for pass in passes {
        let name = format!("{}/{}", pass.folder, pass.stem);
        let interfaces = pass.stages.iter().flat_map(|s| [Some(&s.interface), s.query.as_ref().map(|q| &q.0)]);
        for s in interfaces.flatten().flat_map(|i| &i.structs) {
            match structs.iter().find(|known| known.name == s.name) {
                Some(known) if known == s => {}
                Some(_) => {
                    return Err(format!(
                        "{name}: struct {} differs from the one in {}; keep one definition in lib/ or rename it",
                        s.name, owner[&s.name]
                    ));
                }
                None => {
                    owner.insert(s.name.clone(), name.clone());
                    structs.push(s.clone());
                }
            }
        }
    }
    let mut rust =
        String::from("/// Structs that shaders and the CPU share; one definition for all shaders.\npub mod types {\n");
    let mut listing = String::new();
    let mut sorted: Vec<&Struct> = structs.iter().collect();
    sorted.sort_by(|a, b| a.name.cmp(&b.name));
    for s in sorted {
        write_struct(&mut rust, s, &structs, "    ", "");
        let _ = writeln!(listing, "struct {}  {} bytes", s.name, struct_size(s, &structs));
        for m in &s.members {
            let _ = writeln!(listing, "    {:4} {}: {}", m.offset, m.name, rust_type(&m.ty, ""));
        }
    }
    rust.push_str("}\n/// Constants exported by shader libraries.\npub mod consts {\n");
    for (name, ty, value) in exports {
        let _ = writeln!(rust, "    pub const {name}: {ty} = {value};");
        let _ = writeln!(listing, "const {name}: {ty} = {value}");
    }
    rust.push_str("}\n");
    let mut folder = "";
    for pass in passes {
        if pass.folder != folder {
            if !folder.is_empty() {
                rust.push_str("}\n");
            }
            folder = &pass.folder;
            let _ = writeln!(rust, "/// Passes of `shaders-glsl/{folder}`.\npub mod {folder} {{");
        }
        write_pass(&mut rust, &mut listing, pass, &structs)
            .map_err(|e| format!("{}/{}: {e}", pass.folder, pass.stem))?;
    }
    if !folder.is_empty() {
        rust.push_str("}\n");
    }
    let _ = writeln!(
        rust,
        "/// Every shader of the engine, in all variants.\npub static ALL: &[&crate::shader::Shader] = &["
    );
    for pass in passes {
        let _ = writeln!(rust, "    &{}::{}::SHADER,", pass.folder, pass.stem);
        if pass.stages.iter().any(|s| s.query.is_some()) {
            let _ = writeln!(rust, "    &{}::{}::QUERY,", pass.folder, pass.stem);
        }
    }
    rust.push_str("];\n");
    let _ = writeln!(
        rust,
        "/// All interfaces as text; a golden file holds the reviewed state.\npub const LISTING: &str = {listing:?};"
    );
    Ok(Generated { rust, listing })
}

#[cfg(test)]
#[path = "codegen_tests.rs"]
mod tests;
