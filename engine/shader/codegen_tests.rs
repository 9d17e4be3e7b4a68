//! Interfaces and modules of small shaders.

use super::{
    super::{compile, reflect},
    *,
};

const HEAD: &str = "#version 460\n#extension GL_EXT_scalar_block_layout : require\n";

fn stage(kind: &'static str, source: &str) -> Result<Stage, String> {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("x"), format!("{HEAD}{source}")).unwrap();
    let shader = match kind {
        "Compute" => shaderc::ShaderKind::Compute,
        "Vertex" => shaderc::ShaderKind::Vertex,
        _ => shaderc::ShaderKind::Fragment,
    };
    let interface = |query| -> Result<Interface, String> {
        let compiled = compile::compile(dir.path(), "x", shader, query).unwrap_or_else(|e| panic!("{e}"));
        reflect::reflect(&compiled.reflect)
    };
    let query = source.contains(compile::QUERY_DEFINE).then(|| interface(true)).transpose()?;
    let query = query.map(|interface| (interface, "x.query.spv".to_owned()));
    Ok(Stage { stage: kind, interface: interface(false)?, spirv: "x.spv".into(), query })
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
    let access: Vec<_> = s.interface.bindings.iter().map(|b| b.access).collect();
    use super::super::reflect::Access::*;
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
    let a =
        comp("struct S { float x; };\nlayout(binding = 0, scalar) buffer A { S s[]; };\nvoid main() { s[0].x = 1.0; }")
            .unwrap();
    let b = comp(
        "struct S { vec2 x; };\nlayout(binding = 0, scalar) buffer A { S s[]; };\nvoid main() { s[0].x = vec2(1.0); }",
    )
    .unwrap();
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

#[test]
fn the_engines_constant_is_no_part_of_an_interface_and_its_number_is_taken() {
    let with = |line: &str| {
        let name = line.split(' ').nth(3).unwrap();
        comp(&format!(
            "{line} = 0u;\nlayout(binding = 0, scalar) writeonly buffer O {{ uint o[]; }};\nvoid main() {{ o[0] = {name}; }}"
        ))
    };
    assert!(with("layout(constant_id=31) const uint TRACE_ORDERED").unwrap().interface.spec.is_empty());
    for (line, part) in [
        (
            "layout(constant_id=31) const uint MINE",
            "MINE: constant_id 31; name and number 31 belong to TRACE_ORDERED of the engine",
        ),
        ("layout(constant_id=7) const uint TRACE_ORDERED", "TRACE_ORDERED: constant_id 7"),
    ] {
        let error = with(line).unwrap_err();
        assert!(error.contains(part), "{error}");
    }
}

const TRACE: &str = "#ifdef TRACE_QUERY\nlayout(binding = 47) uniform accelerationStructureEXT top;\n#else\nlayout(binding = \
    40, scalar) readonly buffer Nodes { float nodes[]; };\n#endif\nlayout(binding = 0, scalar) writeonly buffer O { float o[]; };\n";

#[test]
fn a_shader_that_traces_has_two_variants_and_one_args() {
    let body = "void main() {\n#ifdef TRACE_QUERY\nrayQueryEXT q; rayQueryInitializeEXT(q, top, 0u, 0xffu, vec3(0), 0.0, vec3(1), 1.0);\n\
        rayQueryProceedEXT(q); o[0] = rayQueryGetIntersectionTEXT(q, true);\n#else\no[0] = nodes[0];\n#endif\n}";
    let s = comp(&format!("{TRACE}{body}")).unwrap();
    assert!(!s.interface.ray_query && s.query.as_ref().unwrap().0.ray_query);
    let generated = generate(&[pass("t", vec![s])], &[]).unwrap();
    for line in [
        "pub o: crate::graph::Buffer,",
        "pub nodes: crate::graph::Buffer,",
        "pub top: crate::graph::Accel,",
        "if self.top.is_none() {",
        "include_bytes!(\"x.query.spv\")",
        "&t::t::QUERY,",
    ] {
        assert!(generated.rust.contains(line), "{line}\nnot in\n{}", generated.rust);
    }
    assert_eq!(generated.rust.matches("pub struct Args").count(), 1);
    let lines: Vec<&str> = generated.listing.lines().collect();
    assert_eq!(lines[0], "t.t  workgroup [64, 1, 1], in compute and by ray query");
    assert_eq!(lines[2], "    40 nodes: buffer, Read, only in compute");
    assert_eq!(lines[3], "    47 top: acceleration structure, Read, only by ray query");
}

#[test]
fn variants_that_do_not_fit_together_are_refused() {
    let none = comp(
        "layout(binding = 0, scalar) writeonly buffer O { float o[]; };\n// TRACE_QUERY\nvoid main() { o[0] = 1.0; }",
    );
    let error = generate(&[pass("a", vec![none.unwrap()])], &[]).unwrap_err();
    assert!(error.contains("binds no acceleration structure"), "{error}");
    let push = comp(&format!(
        "{TRACE}#ifdef TRACE_QUERY\nlayout(push_constant, scalar) uniform Push {{ uint x; }};\n#endif\nvoid main() {{ o[0] = 1.0; }}"
    ));
    let error = generate(&[pass("b", vec![push.unwrap()])], &[]).unwrap_err();
    assert!(error.contains("push constants") && error.starts_with("t/b"), "{error}");
    let other = TRACE.replace(
        "binding = 47) uniform accelerationStructureEXT top",
        "binding = 40) uniform accelerationStructureEXT top",
    );
    let other = comp(&format!("{other}void main() {{ o[0] = 1.0; }}"));
    let error = generate(&[pass("c", vec![other.unwrap()])], &[]).unwrap_err();
    assert!(error.contains("binding 40 nodes in compute and binding 40 top by ray query"), "{error}");
}
