//! Writes the Rust modules and the plain-text listing of all shader interfaces.

use super::reflect::{Access, Binding, Interface, Kind, Spec, Struct, Type, size_of, struct_size};
use std::{collections::BTreeMap, fmt::Write};

/// One stage of a pass, as compiled.
#[derive(Debug)]
pub struct Stage {
    /// `Compute`, `Vertex` or `Fragment`.
    pub stage: &'static str,
    pub interface: Interface,
    /// Absolute path of the optimised SPIR-V.
    pub spirv: String,
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

/// A binding after merging the stages of a pass.
struct Merged<'a> {
    binding: &'a Binding,
    access: Access,
    stages: Vec<&'static str>,
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

fn merge<'a>(pass: &'a Pass) -> Result<Vec<Merged<'a>>, String> {
    let mut merged: Vec<Merged> = Vec::new();
    for stage in &pass.stages {
        for b in &stage.interface.bindings {
            match merged.iter_mut().find(|m| m.binding.binding == b.binding) {
                None => merged.push(Merged { binding: b, access: b.access, stages: vec![stage.stage] }),
                Some(m) if m.binding.name == b.name && m.binding.kind == b.kind && m.binding.count == b.count => {
                    m.stages.push(stage.stage);
                    if m.access != b.access {
                        m.access = Access::ReadWrite;
                    }
                }
                Some(m) => {
                    return Err(format!(
                        "binding {} is {} in one stage and {} in the other; number bindings over both stages",
                        b.binding, m.binding.name, b.name
                    ));
                }
            }
        }
    }
    merged.sort_by_key(|m| m.binding.binding);
    for (i, m) in merged.iter().enumerate() {
        if merged[..i].iter().any(|other| other.binding.name == m.binding.name) {
            return Err(format!("two bindings are named {}", m.binding.name));
        }
    }
    Ok(merged)
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
    let bindings = merge(pass)?;
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
    for m in &bindings {
        let b = m.binding;
        let ty = match &b.kind {
            Kind::Sampled(_) | Kind::Storage(_) => "crate::graph::Image".to_owned(),
            Kind::Buffer | Kind::AccelerationStructure => "crate::graph::Buffer".to_owned(),
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
        let _ = writeln!(listing, "    {:2} {}: {kind}{count}, {:?}", b.binding, b.name, m.access);
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

    write_shader(out, &name, pass, &bindings, spec, push_size, workgroup, outputs, structs);

    let _ = writeln!(
        out,
        "        impl crate::shader::Args for Args {{\n            const SHADER: &'static crate::shader::Shader = &SHADER;"
    );
    let unused = if bindings.is_empty() { "_out" } else { "out" };
    let _ = writeln!(out, "            fn resources(&self, {unused}: &mut Vec<crate::shader::Resource>) {{");
    for m in &bindings {
        let b = m.binding;
        let variant = match &b.kind {
            Kind::Sampled(_) | Kind::Storage(_) => "Image",
            Kind::Buffer | Kind::AccelerationStructure => "Buffer",
            Kind::Uniform(_) => "Uniform",
        };
        let convert = if variant == "Uniform" { ".into()" } else { "" };
        if b.count > 1 {
            let _ = writeln!(
                out,
                "                out.extend(self.{}.iter().map(|r| crate::shader::Resource::{variant}(*r)));",
                b.name
            );
        } else {
            let _ = writeln!(
                out,
                "                out.push(crate::shader::Resource::{variant}(self.{}{convert}));",
                b.name
            );
        }
    }
    let _ = writeln!(out, "            }}");
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
    let _ = writeln!(out, "        }}\n        impl crate::shader::{which} for Args {{}}\n    }}");
    Ok(())
}

#[allow(clippy::too_many_arguments)]
fn write_shader(
    out: &mut String,
    name: &str,
    pass: &Pass,
    bindings: &[Merged],
    spec: &[Spec],
    push_size: u32,
    workgroup: [u32; 3],
    outputs: u32,
    structs: &[Struct],
) {
    let _ = writeln!(
        out,
        "        /// Code and interface.\n        pub static SHADER: crate::shader::Shader = crate::shader::Shader {{\n            name: {name:?},\n            stages: &["
    );
    for s in &pass.stages {
        let _ = writeln!(
            out,
            "                crate::shader::StageCode {{ stage: crate::shader::Stage::{}, spirv: include_bytes!({:?}) }},",
            s.stage, s.spirv
        );
    }
    let _ = writeln!(out, "            ],\n            bindings: &[");
    for m in bindings {
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
    for s in spec {
        let _ = writeln!(out, "                crate::shader::SpecConstant {{ name: {:?}, id: {} }},", s.name, s.id);
    }
    let _ = writeln!(out, "            ],\n            color_outputs: {outputs},\n        }};\n");
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
        for s in pass.stages.iter().flat_map(|s| &s.interface.structs) {
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
    let _ = writeln!(rust, "/// Every shader of the engine.\npub static ALL: &[&crate::shader::Shader] = &[");
    for pass in passes {
        let _ = writeln!(rust, "    &{}::{}::SHADER,", pass.folder, pass.stem);
    }
    rust.push_str("];\n");
    let _ = writeln!(
        rust,
        "/// All interfaces as text; a golden file holds the reviewed state.\npub const LISTING: &str = {listing:?};"
    );
    Ok(Generated { rust, listing })
}

#[cfg(test)]
mod tests {
    use super::super::{compile, reflect};
    use super::*;

    const HEAD: &str = "#version 460\n#extension GL_EXT_scalar_block_layout : require\n";

    fn stage(kind: &'static str, source: &str) -> Result<Stage, String> {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("x"), format!("{HEAD}{source}")).unwrap();
        let shader = match kind {
            "Compute" => shaderc::ShaderKind::Compute,
            "Vertex" => shaderc::ShaderKind::Vertex,
            _ => shaderc::ShaderKind::Fragment,
        };
        let compiled = compile::compile(dir.path(), "x", shader).unwrap_or_else(|e| panic!("{e}"));
        Ok(Stage { stage: kind, interface: reflect::reflect(&compiled.reflect)?, spirv: "x.spv".into() })
    }

    fn pass(stem: &str, stages: Vec<Stage>) -> Pass {
        Pass { folder: "t".into(), stem: stem.into(), stages }
    }

    fn comp(body: &str) -> Result<Stage, String> {
        stage("Compute", &format!("layout(local_size_x = 64) in;\n{body}"))
    }

    #[test]
    fn scalar_layout_has_no_padding() {
        let s = comp("layout(binding = 0, scalar) uniform Block { vec3 a; vec4 b; mat3 m; float c[3]; };\nlayout(binding = 1, scalar) writeonly buffer O { float o[]; };\nvoid main() { o[0] = a.x + b.x + m[0].x + c[1]; }").unwrap();
        let offsets: Vec<u32> = s.interface.structs[0].members.iter().map(|m| m.offset).collect();
        assert_eq!(offsets, [0, 12, 28, 64]);
        assert_eq!(reflect::struct_size(&s.interface.structs[0], &s.interface.structs), 76);
    }

    #[test]
    fn another_layout_than_scalar_is_refused_by_name() {
        let error = comp("layout(binding = 0, std140) uniform Block { float c[3]; };\nlayout(binding = 1, scalar) writeonly buffer O { float o[]; };\nvoid main() { o[0] = c[1]; }").unwrap_err();
        assert!(error.contains("Block.c: array stride"), "{error}");
    }

    #[test]
    fn qualifiers_are_the_access() {
        let s = comp("layout(binding = 0, scalar) readonly buffer A { float a[]; };\nlayout(binding = 1, scalar) writeonly buffer B { float b[]; };\nlayout(binding = 2, scalar) buffer C { float c[]; };\nlayout(binding = 3, r32f) uniform readonly image2D d;\nlayout(binding = 4, r32f) uniform writeonly image2D e;\nlayout(binding = 5, r32f) uniform image2D f;\nvoid main() { b[0] = a[0]; c[0] += 1.0; imageStore(e, ivec2(0), imageLoad(d, ivec2(0))); imageStore(f, ivec2(0), vec4(0)); }").unwrap();
        let access: Vec<Access> = s.interface.bindings.iter().map(|b| b.access).collect();
        use Access::*;
        assert_eq!(access, [Read, Write, ReadWrite, Read, Write, ReadWrite]);
    }

    #[test]
    fn an_unused_binding_stays_in_the_interface() {
        let s = comp("layout(binding = 7) uniform samplerCube sky;\nvoid main() {}").unwrap();
        assert_eq!(s.interface.bindings[0].name, "sky");
        assert_eq!(s.interface.bindings[0].kind, Kind::Sampled("Cube"));
    }

    #[test]
    fn too_many_push_constants_are_refused_with_the_shader_named() {
        let s = comp("layout(push_constant, scalar) uniform Push { mat4 a; mat4 b; float c; };\nlayout(binding = 0, scalar) writeonly buffer O { float o[]; };\nvoid main() { o[0] = a[0].x + b[0].x + c; }").unwrap();
        let error = generate(&[pass("big", vec![s])], &[]).unwrap_err();
        assert!(error.starts_with("t/big: 132 bytes"), "{error}");
    }

    #[test]
    fn two_structs_of_one_name_must_agree() {
        let a = comp(
            "struct S { float x; };\nlayout(binding = 0, scalar) buffer A { S s[]; };\nvoid main() { s[0].x = 1.0; }",
        )
        .unwrap();
        let b = comp("struct S { vec2 x; };\nlayout(binding = 0, scalar) buffer A { S s[]; };\nvoid main() { s[0].x = vec2(1.0); }").unwrap();
        let error = generate(&[pass("a", vec![a]), pass("b", vec![b])], &[]).unwrap_err();
        assert!(error.contains("t/b: struct S differs from the one in t/a"), "{error}");
    }

    #[test]
    fn stages_that_disagree_on_a_binding_are_refused() {
        let v = stage("Vertex", "layout(binding = 0, scalar) readonly buffer P { vec4 p[]; };\nvoid main() { gl_Position = p[gl_VertexIndex]; }").unwrap();
        let f = stage("Fragment", "layout(binding = 0) uniform sampler2D image;\nlayout(location = 0) out vec4 c;\nvoid main() { c = textureLod(image, vec2(0), 0.0); }").unwrap();
        let error = generate(&[pass("r", vec![v, f])], &[]).unwrap_err();
        assert!(error.contains("binding 0 is p in one stage") || error.contains("binding 0 is"), "{error}");
    }

    #[test]
    fn specialisation_constants_keep_their_defaults() {
        let s = comp("layout(constant_id = 2) const float SCALE = 0.5;\nlayout(constant_id = 1) const int SHIFT = -3;\nlayout(binding = 0, scalar) writeonly buffer O { float o[]; };\nvoid main() { o[0] = SCALE + float(SHIFT); }").unwrap();
        let text = generate(&[pass("s", vec![s])], &[]).unwrap().rust;
        assert!(text.contains("shift: -3,"), "{text}");
        assert!(text.contains(&format!("scale: f32::from_bits({})", 0.5f32.to_bits())), "{text}");
    }
}
