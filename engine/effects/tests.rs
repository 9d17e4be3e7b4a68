//! Pipelines in text: each kind of mistake beside its message, closed forms of each kind of pass, and random chains beside their simulation.

use std::{collections::BTreeMap, fs, path::Path};

use serde_json::json;

use super::{Pipeline, Values};
use crate::{
    gpu::testing::with_gpu,
    graph::{Extent, Format, Graph, Runner},
    scene::{Camera, Projection, View},
};

const TWICE: &str = "layout(binding = 0) uniform sampler2D picture;\nlayout(push_constant) uniform Push { float factor; };\n\
    layout(location = 0) in vec2 uv;\nlayout(location = 0) out vec4 color;\n\
    void main() { color = factor * texelFetch(picture, ivec2(gl_FragCoord.xy), 0); }\n";

fn written(files: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

fn read(folder: &Path) -> crate::Result<Pipeline> {
    Pipeline::read(&folder.join("p.toml"))
}

#[test]
fn every_mistake_has_its_file_its_line_and_what_is_allowed() {
    let head = "[constants.factor]\ndefault = 2.0\n\n";
    let pass = "[[pass]]\nshader = \"a.frag\"\nout = \"picture\"\n";
    let good = TWICE;
    let toml = |rest: &str| format!("{head}{rest}");
    let cases: Vec<(String, String, &[&str])> = vec![
        (String::new(), good.into(), &["p.toml", "there is no pass", "[[pass]]"]),
        ("title = ".into(), good.into(), &["p.toml", "line 1"]),
        (toml("[[pass]]\nshadr = \"a.frag\"\n"), good.into(), &["line 5", "shadr", "shader"]),
        (toml(&format!("technique = \"isr\"\n{pass}")), good.into(), &["line 4", "technique"]),
        (format!("technique = \"ist\"\n{head}{pass}"), good.into(), &["line 1", "\"ist\"", "isr, igi"]),
        (
            toml("[[pass]]\nshader = \"b.frag\"\nout = \"picture\"\n"),
            good.into(),
            &["line 4", "b.frag", "does not exist"],
        ),
        (
            toml("[[pass]]\nshader = \"a.vert\"\nout = \"picture\"\n"),
            good.into(),
            &["line 4", "a.vert", ".frag or .comp"],
        ),
        (
            toml("[[pass]]\nshader = \"../a.frag\"\nout = \"picture\"\n"),
            good.into(),
            &["line 4", "must lie in the folder"],
        ),
        (
            toml("[[pass]]\nshader = \"a.frag\"\nout = \"half\"\n"),
            good.into(),
            &["line 4", "\"half\"", "picture", "[images.half]"],
        ),
        (toml("[[pass]]\nshader = \"a.frag\"\n"), good.into(), &["line 4", "out names 0 images", "writes 1"]),
        (
            toml(&format!("{pass}bind = {{ depht = \"gbuffer.depth\" }}\n")),
            good.into(),
            &["line 4", "bind.depht", "it has picture"],
        ),
        (
            toml(&format!("{pass}values = {{ facto = 1.0 }}\n")),
            good.into(),
            &["line 4", "values.facto", "it has factor"],
        ),
        (toml(&format!("{pass}when = \"factor\"\n")), good.into(), &["line 4", "no switch", "default = true"]),
        (
            toml(&format!("{pass}bind = {{ picture = {{ image = \"picture\", sampler = \"cubic\" }} }}\n")),
            good.into(),
            &["line 4", "cubic", "nearest"],
        ),
        (pass.into(), good.into(), &["line 1", "push constant factor (float)", "there are none"]),
        (format!("[constants.factor]\ndefault = [1, 2]\n{pass}"), good.into(), &["line 3", "factor is float"]),
        (format!("[constants.factor]\ndefault = \"x\"\n{pass}"), good.into(), &["line 1", "constants.factor.default"]),
        (format!("[constants.factor]\ndefault = 3.0\nmost = 2.0\n{pass}"), good.into(), &["line 1", "up to 2"]),
        (
            format!("[constants.size]\ndefault = 3.0\n{pass}"),
            good.into(),
            &["line 1", "\"size\" cannot name a constant"],
        ),
        (
            format!("{head}[constants.on]\ndefault = true\nkey = \"F1\"\n{pass}"),
            good.into(),
            &["line 4", "\"F1\"", "F6"],
        ),
        (format!("{head}[images.x]\nformat = \"rgb16f\"\n{pass}"), good.into(), &["line 4", "\"rgb16f\"", "rgba16f"]),
        (format!("{head}[images.x]\nformat = \"r8\"\nscale = 9.0\n{pass}"), good.into(), &["line 4", "scale is 9"]),
        (
            format!("{head}[images.x]\nformat = \"r8\"\nscale = 1.0\nsize = [1, 1]\n{pass}"),
            good.into(),
            &["line 4", "scale and size"],
        ),
        (format!("{head}[images.picture]\nformat = \"r8\"\n{pass}"), good.into(), &["line 4", "cannot name an image"]),
        (
            toml("[[pass]]\nstage = \"bloor\"\nimage = \"picture\"\nout = \"picture\"\n"),
            good.into(),
            &["line 4", "\"bloor\"", "blur, mips, scale"],
        ),
        (toml("[[pass]]\nstage = \"blur\"\nout = \"picture\"\n"), good.into(), &["line 4", "names no image"]),
        (
            toml("[[pass]]\nstage = \"blur\"\nimage = \"picture\"\nradius = 0\nout = \"x\"\n"),
            good.into(),
            &["line 4", "radius is 0"],
        ),
        (
            toml("[[pass]]\nstage = \"blur\"\nshader = \"a.frag\"\nout = \"x\"\n"),
            good.into(),
            &["line 4", "either shader or stage"],
        ),
        (toml(pass), good.replace("factor *", "faktor *"), &["a.frag", "line 5", "'faktor'"]),
        (toml(pass), good.replace("binding = 0", "set = 1, binding = 0"), &["a.frag", "descriptor set 1"]),
        (
            toml(pass),
            good.replace("sampler2D picture", "samplerCube picture")
                .replace("texelFetch(picture, ivec2(gl_FragCoord.xy), 0)", "texture(picture, vec3(uv, 1))"),
            &["a.frag", "Cube", "sampler2D"],
        ),
        (toml(pass), format!("layout(binding = 3) buffer B {{ float b[]; }};\n{good}"), &["a.frag", "storage buffer"]),
        (
            toml(pass),
            format!("layout(binding = 3) uniform B {{ vec4 b; }};\n{good}"),
            &["a.frag", "uniform block", "push constants"],
        ),
        (toml(pass), format!("#include \"lib/vew.glsl\"\n{good}"), &["a.frag", "line 1", "lib/view.glsl"]),
        (toml(pass), format!("#include \"../x.glsl\"\n{good}"), &["a.frag", "must stay inside"]),
        (toml(pass), format!("#include \"loop.glsl\"\n{good}"), &["a.frag", "cycle"]),
        (
            toml(pass),
            good.replace("sampler2D picture", "sampler2DShadow picture")
                .replace("texelFetch(picture, ivec2(gl_FragCoord.xy), 0)", "vec4(texture(picture, vec3(uv, 1)))"),
            &["a.frag", "compares depths"],
        ),
        (
            toml(pass),
            good.replace("layout(location = 0) out", "layout(location = 1) out"),
            &["a.frag", "locations 0, 1, 2"],
        ),
        (
            toml(pass),
            good.replace("out vec4 color", "out vec4 color[2]").replace("color =", "color[0] ="),
            &["a.frag", "locations 0, 1, 2"],
        ),
        (toml(pass), String::new(), &["a.frag"]),
    ];
    for (toml, shader, parts) in cases {
        let folder = written(&[("p.toml", &toml), ("a.frag", &shader), ("loop.glsl", "#include \"loop.glsl\"\n")]);
        let error = read(folder.path()).expect_err(&toml);
        let text = error.to_string();
        assert_eq!(error.exit_code(), 3, "{text}\n{toml}");
        for part in parts {
            assert!(text.contains(part), "{part:?} is not in: {text}\n{toml}");
        }
    }
}

/// Pixels after a pipeline whose picture is 4×4 of this colour.
fn run(pipeline: &Pipeline, color: [f32; 4], values: &Values, frames: u32) -> crate::Result<Vec<[f32; 4]>> {
    let mut out = Ok(Vec::new());
    with_gpu(|gpu| {
        let mut runner = Runner::new(gpu);
        for number in 0..frames {
            let mut graph = Graph::new("effects");
            graph.frame = number;
            let picture = graph.image("total", Format::RGBA32F, Extent::new(4, 4));
            graph.clear(picture, color);
            let made = pipeline.frame(&mut graph, picture, &view(), 0.5, values);
            out = made.map(|made| {
                let token = graph.read_image(made);
                runner.run(graph).unwrap().image(token).to_f32()
            });
        }
    });
    out
}

fn view() -> View {
    let projection = Projection::Perspective { yfov: 1.0, aspect: None, znear: 0.1, zfar: Some(10.0) };
    View::new(&Camera { name: String::new(), projection }, glam::Mat4::IDENTITY, [4, 4])
}

#[test]
fn constants_switches_and_order() {
    let text = "[constants.factor]\ndefault = 2.0\nleast = 0.0\nmost = 100.0\n[constants.on]\ndefault = true\n\
        [[pass]]\nshader = \"a.frag\"\nout = \"picture\"\nwhen = \"on\"\n\
        [[pass]]\nshader = \"a.frag\"\nout = \"picture\"\nvalues = { factor = 10.0 }\nwhen = [\"not on\"]\n\
        [[pass]]\nshader = \"a.frag\"\nout = \"picture\"\nvalues = { factor = 3.0 }\n";
    let folder = written(&[("p.toml", text), ("a.frag", TWICE)]);
    let pipeline = read(folder.path()).unwrap();
    let of = |values: serde_json::Value| -> Values { serde_json::from_value(values).unwrap() };
    for (values, factor) in [(json!({}), 6.0), (json!({ "factor": 0.5 }), 1.5), (json!({ "on": false }), 30.0)] {
        let found = run(&pipeline, [1.0, 2.0, 4.0, 0.5], &of(values.clone()), 1).unwrap();
        if !found.is_empty() {
            assert!(
                found.iter().all(|p| *p == [factor, 2.0 * factor, 4.0 * factor, 0.5 * factor]),
                "{values}: {found:?}"
            );
        }
    }
    for (values, part) in [
        (json!({ "factor": 101.0 }), "0 to 100"),
        (json!({ "factor": true }), "not allowed"),
        (json!({ "on": 1 }), "true, false"),
        (json!({ "fact": 1.0 }), "it has factor, on"),
    ] {
        let error = pipeline.check(&of(values)).unwrap_err();
        assert!(error.exit_code() == 2 && error.to_string().contains(part), "{error}");
    }
    // All switches off: the picture itself, and no pass.
    let folder =
        written(&[("p.toml", &text.split("[[pass]]").take(2).collect::<Vec<_>>().join("[[pass]]")), ("a.frag", TWICE)]);
    let mut graph = Graph::new("none");
    let picture = graph.image("total", Format::RGBA32F, Extent::new(4, 4));
    let made =
        read(folder.path()).unwrap().frame(&mut graph, picture, &view(), 0.0, &of(json!({ "on": false }))).unwrap();
    assert!(made == picture && graph.pass_count() == 0);
}

#[test]
fn images_history_compute_and_stages() {
    // The sum of all frames so far, by a compute shader; then blurred, scaled down and its mean taken, which leave an even picture as it is.
    let text = "[images.sum]\nformat = \"rgba32f\"\nhistory = true\n[images.small]\nformat = \"rgba32f\"\nscale = 0.5\nmips = true\n\
        [[pass]]\nshader = \"add.comp\"\nbind = { before = \"sum.previous\" }\nout = \"sum\"\n\
        [[pass]]\nstage = \"blur\"\nimage = \"sum\"\nradius = 2\nout = \"soft\"\n\
        [[pass]]\nstage = \"scale\"\nimage = \"soft\"\nout = \"small\"\n\
        [[pass]]\nstage = \"mips\"\nimage = \"small\"\n\
        [[pass]]\nshader = \"show.frag\"\nbind = { mean = { image = \"small\", mip = 1 } }\nout = \"picture\"\n";
    let add = "#include \"lib/view.glsl\"\nlayout(local_size_x = 8, local_size_y = 8) in;\nlayout(binding = 0) uniform sampler2D picture;\n\
        layout(binding = 1) uniform sampler2D before;\nlayout(binding = 2, rgba32f) uniform writeonly image2D sum;\n\
        layout(binding = 3, scalar) uniform ViewBlock { View view; };\n\
        layout(push_constant) uniform Push { vec2 size; float seconds; uint frame; };\n\
        void main() { ivec2 at = ivec2(gl_GlobalInvocationID.xy); if (any(greaterThanEqual(at, ivec2(size)))) return;\n\
        vec4 old = frame > 0u ? texelFetch(before, at, 0) : vec4(0.0);\n\
        imageStore(sum, at, old + texelFetch(picture, at, 0) + vec4(0.0, seconds, view.far, 0.0)); }\n";
    let show = "layout(binding = 0) uniform sampler2D mean;\nlayout(location = 0) in vec2 uv;\nlayout(location = 0) out vec4 color;\n\
        void main() { color = texture(mean, uv); }\n";
    let folder = written(&[("p.toml", text), ("add.comp", add), ("show.frag", show)]);
    let pipeline = read(folder.path()).unwrap();
    let found = run(&pipeline, [1.0, 0.0, 0.0, 1.0], &Values::new(), 3).unwrap();
    for pixel in found {
        assert!(
            (pixel[0] - 3.0).abs() < 0.01 && (pixel[1] - 1.5).abs() < 0.01 && (pixel[2] - 30.0).abs() < 0.1,
            "{pixel:?}"
        );
    }
}

#[test]
fn images_that_are_not_there_are_named() {
    let own = "[images.x]\nformat = \"rgba32f\"\n[images.y]\nformat = \"rgba32f\"\n[constants.on]\ndefault = false\n[constants.factor]\ndefault = 1.0\n";
    for (rest, parts) in [
        (
            "[[pass]]\nshader = \"a.frag\"\nbind = { picture = \"gbuffer.depht\" }\nout = \"picture\"\n",
            &["line 9", "gbuffer.depht", "total"][..],
        ),
        (
            "[[pass]]\nshader = \"a.frag\"\nbind = { picture = \"x\" }\nout = \"picture\"\n",
            &["line 9", "no pass that runs writes it"],
        ),
        (
            "[[pass]]\nshader = \"a.frag\"\nout = \"x\"\nwhen = \"on\"\n[[pass]]\nshader = \"a.frag\"\nbind = { picture = \"x\" }\nout = \"picture\"\n",
            &["line 13", "no pass that runs writes it"],
        ),
        (
            "[[pass]]\nshader = \"a.frag\"\nout = \"x\"\n[[pass]]\nshader = \"a.frag\"\nbind = { picture = \"x\" }\nout = \"x\"\n",
            &["line 12", "reads and writes \"x\"", "history"],
        ),
        (
            "[[pass]]\nshader = \"a.frag\"\nbind = { picture = { image = \"picture\", mip = 3 } }\nout = \"picture\"\n",
            &["line 9", "level 3", "levels 0 to 0"],
        ),
        (
            "[images.n]\nformat = \"r32u\"\n[[pass]]\nshader = \"a.frag\"\nout = \"n\"\n",
            &["line 11", "writes Float to \"n\"", "uvec4"],
        ),
        (
            "[[pass]]\nshader = \"a.frag\"\nout = \"x\"\n[[pass]]\nstage = \"mips\"\nimage = \"x\"\n",
            &["line 12", "only one", "mips = true"],
        ),
    ] {
        let folder = written(&[("p.toml", &format!("{own}{rest}")), ("a.frag", TWICE)]);
        let mut graph = Graph::new("effects");
        let picture = graph.image("total", Format::RGBA32F, Extent::new(4, 4));
        graph.clear(picture, [1.0; 4]);
        let error = read(folder.path()).unwrap().frame(&mut graph, picture, &view(), 0.0, &Values::new()).unwrap_err();
        let text = error.to_string();
        assert!(error.exit_code() == 3 && parts.iter().all(|part| text.contains(part)), "{text}\n{rest}");
    }
}

#[test]
fn random_pipelines_are_as_simulated() {
    const MIX: &str = "layout(binding = 0) uniform sampler2D a;\nlayout(binding = 1) uniform sampler2D b;\n\
        layout(push_constant) uniform Push { float p; float q; };\nlayout(location = 0) in vec2 uv;\nlayout(location = 0) out vec4 color;\n\
        void main() { color = p * texelFetch(a, ivec2(gl_FragCoord.xy), 0) + q * texelFetch(b, ivec2(gl_FragCoord.xy), 0); }\n";
    let mut state = 1u32;
    let mut random = |below: u32| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 16) % below
    };
    for _ in 0..12 {
        let names = ["picture", "u", "v", "w"];
        let mut values: BTreeMap<&str, f32> = BTreeMap::from([("picture", 3.0)]);
        let mut text = String::new();
        for name in &names[1..] {
            text += &format!("[images.{name}]\nformat = \"rgba32f\"\n");
        }
        text += "[constants.on]\ndefault = true\n";
        for _ in 0..3 + random(12) {
            let known: Vec<&str> = values.keys().copied().collect();
            let [a, b] = [0, 1].map(|_| known[random(known.len() as u32) as usize]);
            let out = names[random(4) as usize];
            if out != "picture" && (a == out || b == out) {
                continue;
            }
            let [p, q] = [0, 1].map(|_| random(5) as f32 - 2.0);
            let off = random(4) == 0;
            let when = if off { "not on" } else { "on" };
            text += &format!(
                "[[pass]]\nshader = \"mix.frag\"\nbind = {{ a = \"{a}\", b = \"{b}\" }}\nvalues = {{ p = {p:?}, q = {q:?} }}\nout = \"{out}\"\nwhen = \"{when}\"\n"
            );
            if !off {
                let value = p * values[a] + q * values[b];
                values.insert(out, value);
            }
        }
        text += "[[pass]]\nshader = \"mix.frag\"\nbind = { a = \"picture\", b = \"picture\" }\nvalues = { p = 1.0, q = 0.0 }\nout = \"picture\"\n";
        let folder = written(&[("p.toml", &text), ("mix.frag", MIX)]);
        let found = run(&read(folder.path()).unwrap(), [3.0; 4], &Values::new(), 1).unwrap();
        for pixel in found {
            assert_eq!(pixel, [values["picture"]; 4], "{text}");
        }
    }
}

#[test]
fn the_same_text_is_the_same_shader_and_a_change_is_another_digest() {
    let text = "[constants.factor]\ndefault = 2.0\n[[pass]]\nshader = \"a.frag\"\nout = \"picture\"\n";
    let folder = written(&[
        ("p.toml", text),
        ("a.frag", &format!("#include \"own.glsl\"\n{TWICE}")),
        ("own.glsl", "const int N = 1;\n"),
    ]);
    let first = read(folder.path()).unwrap();
    let again = read(folder.path()).unwrap();
    assert_eq!(first.digest(), again.digest());
    assert_eq!(first.files().len(), 3);
    fs::write(folder.path().join("own.glsl"), "const int N = 2;\n").unwrap();
    assert_ne!(read(folder.path()).unwrap().digest(), first.digest());
    // The files of a pipeline with a mistake are known, too, for those who wait for its end.
    fs::write(folder.path().join("p.toml"), format!("{text}[[pass]]\nshader = \"missing.frag\"\n")).unwrap();
    assert!(read(folder.path()).is_err());
    let files = Pipeline::files_of(&folder.path().join("p.toml"));
    assert!(files.len() == 4 && files.contains(&folder.path().join("missing.frag")), "{files:?}");
}
