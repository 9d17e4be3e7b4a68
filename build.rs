//! Compiles every entry shader under `shaders-glsl/`, reads its interface and writes one typed Rust module per pass.
//!
//! `<folder>/<pass>.comp` becomes `shaders::<folder>::<pass>`; `.vert` and `.frag` of the same stem become one raster pass.
//! A `.frag` alone is drawn by `common/fullscreen.vert`. `.glsl` files are included: those in `lib` by all folders, others by the shaders of
//! their own folder and by `test`. Only shaders whose text (with includes) changed are compiled again.

#[path = "engine/shader/codegen.rs"]
mod codegen;
#[path = "engine/shader/compile.rs"]
mod compile;
#[path = "engine/shader/reflect.rs"]
mod reflect;
#[path = "engine/shader/variants.rs"]
mod variants;

use codegen::{Export, Pass, Stage};
use std::{
    collections::BTreeMap,
    env, fs,
    hash::{DefaultHasher, Hash, Hasher},
    path::{Path, PathBuf},
    process::exit,
};

const FULLSCREEN: &str = "common/fullscreen.vert";

fn main() {
    println!("cargo:rerun-if-changed=shaders-glsl");
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=engine/shader");
    println!("cargo:rerun-if-env-changed=SHADERC_LIB_DIR");
    println!("cargo:rustc-env=LUCERNA_SHADER_COMPILER={}", compiler());
    if let Err(message) = run() {
        // One line each, so that cargo shows `file:line: error: …` as the compiler wrote it.
        for line in message.lines() {
            println!("cargo:warning={line}");
        }
        eprintln!("{message}");
        exit(1);
    }
}

/// Name of the shader compiler, for the metadata of pictures: the folder of the library, which ci/setup names by its versions.
fn compiler() -> String {
    let folder = env::var_os("SHADERC_LIB_DIR").map(PathBuf::from);
    let name = folder.as_deref().map(file_name).filter(|name| name.starts_with("shaderc"));
    name.unwrap_or_else(|| "shaderc of the system, or built from source".to_owned())
}

fn run() -> Result<(), String> {
    let root = PathBuf::from("shaders-glsl");
    let out = PathBuf::from(env::var("OUT_DIR").map_err(|e| e.to_string())?);
    let mut passes: BTreeMap<(String, String), Vec<(&'static str, String)>> = BTreeMap::new();
    let mut exports = Vec::new();
    for folder in sorted(&root)? {
        let name = file_name(&folder);
        for file in sorted(&folder)? {
            let text = file_name(&file);
            let relative = format!("{name}/{text}");
            let (stem, extension) = text.rsplit_once('.').unwrap_or((&text, ""));
            let stage = match extension {
                "comp" => "Compute",
                "vert" => "Vertex",
                "frag" => "Fragment",
                "glsl" => {
                    exports.extend(exported(&file)?);
                    continue;
                }
                _ => {
                    return Err(format!("shaders-glsl/{relative}: unknown kind of file; .comp, .vert, .frag or .glsl"));
                }
            };
            if name == "lib" {
                return Err(format!("shaders-glsl/{relative}: shaders belong into the folder of their technique"));
            }
            if relative != FULLSCREEN {
                passes.entry((name.clone(), stem.to_owned())).or_default().push((stage, relative));
            }
        }
    }
    let mut built = Vec::new();
    let mut errors = Vec::new();
    for ((folder, stem), mut files) in passes {
        if files.len() == 1 && files[0].0 == "Fragment" {
            files.push(("Vertex", FULLSCREEN.to_owned()));
        }
        // Compute, Vertex, Fragment: vertex before fragment.
        files.sort_by_key(|(stage, _)| *stage == "Fragment");
        let mut stages = Vec::new();
        for (stage, file) in files {
            match build(&root, &out, stage, &file) {
                Ok(s) => stages.push(s),
                Err(e) => errors.push(e),
            }
        }
        built.push(Pass { folder, stem, stages });
    }
    if !errors.is_empty() {
        return Err(errors.join("\n"));
    }
    let generated = codegen::generate(&built, &exports)?;
    write_if_changed(&out.join("shaders.rs"), generated.rust.as_bytes())?;
    write_if_changed(&out.join("library.rs"), library(&root)?.as_bytes())?;
    write_if_changed(&out.join("interfaces.txt"), generated.listing.as_bytes())
}

/// Compiles one file, in both variants if it traces rays.
fn build(root: &Path, out: &Path, stage: &'static str, file: &str) -> Result<Stage, String> {
    let (interface, spirv) = variant(root, out, stage, file, false)?;
    let query = compile::traces(root, file).then(|| variant(root, out, stage, file, true)).transpose()?;
    Ok(Stage { stage, interface, spirv, query })
}

/// Compiles one variant of a file unless its text is the one compiled last.
fn variant(
    root: &Path,
    out: &Path,
    stage: &'static str,
    file: &str,
    query: bool,
) -> Result<(reflect::Interface, String), String> {
    let key = {
        let mut hasher = DefaultHasher::new();
        // Another compiler writes another module.
        let compiler = env::var_os("SHADERC_LIB_DIR");
        (compile::closure(root, file), include_str!("engine/shader/compile.rs"), compiler).hash(&mut hasher);
        format!("{:016x}", hasher.finish())
    };
    let base = out.join(file.replace('/', ".") + if query { ".query" } else { "" });
    let (ship, raw, stamp) = (with(&base, "spv"), with(&base, "raw"), with(&base, "key"));
    let fresh = fs::read_to_string(&stamp).is_ok_and(|k| k == key) && ship.exists() && raw.exists();
    if !fresh {
        let kind = match stage {
            "Compute" => shaderc::ShaderKind::Compute,
            "Vertex" => shaderc::ShaderKind::Vertex,
            _ => shaderc::ShaderKind::Fragment,
        };
        let compiled = compile::compile(root, file, kind, query)?;
        write_if_changed(&ship, &compiled.ship)?;
        let bytes: Vec<u8> = compiled.reflect.iter().flat_map(|w| w.to_le_bytes()).collect();
        write_if_changed(&raw, &bytes)?;
        write_if_changed(&stamp, key.as_bytes())?;
    }
    let bytes = fs::read(&raw).map_err(|e| format!("{}: {e}", raw.display()))?;
    let words: Vec<u32> = bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
    let interface = reflect::reflect(&words).map_err(|e| format!("{}: error: {e}", root.join(file).display()))?;
    Ok((interface, ship.display().to_string()))
}

fn with(base: &Path, extension: &str) -> PathBuf {
    let mut name = base.as_os_str().to_owned();
    name.push(".");
    name.push(extension);
    name.into()
}

/// Constants marked for the CPU: `const uint MAX_LIGHTS = 64; // export`.
fn exported(file: &Path) -> Result<Vec<Export>, String> {
    let text = fs::read_to_string(file).map_err(|e| format!("{}: {e}", file.display()))?;
    let mut found = Vec::new();
    for (line, text) in text.lines().enumerate().filter(|(_, l)| l.trim_end().ends_with("// export")) {
        let bad = || format!("{}:{}: error: expected `const TYPE NAME = VALUE; // export`", file.display(), line + 1);
        let body = text.trim().strip_prefix("const ").and_then(|t| t.split_once(';')).ok_or_else(bad)?.0;
        let (head, value) = body.split_once('=').ok_or_else(bad)?;
        let (ty, name) = head.trim().split_once(' ').ok_or_else(bad)?;
        let (ty, value) = match ty {
            "uint" => ("u32", value.trim().trim_end_matches(['u', 'U']).to_owned()),
            "int" => ("i32", value.trim().to_owned()),
            "float" => ("f32", value.trim().trim_end_matches(['f', 'F']).to_owned()),
            _ => return Err(bad()),
        };
        found.push((name.trim().to_owned(), ty, value));
    }
    Ok(found)
}

/// The includes that all shaders share, for shaders that are compiled at run time.
fn library(root: &Path) -> Result<String, String> {
    let mut out = String::from("&[\n");
    for file in sorted(&root.join("lib"))? {
        let text = fs::read_to_string(&file).map_err(|e| format!("{}: {e}", file.display()))?;
        out += &format!("({:?}, {text:?}),\n", format!("lib/{}", file_name(&file)));
    }
    Ok(out + "]\n")
}

fn sorted(folder: &Path) -> Result<Vec<PathBuf>, String> {
    let entries = fs::read_dir(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut paths: Vec<PathBuf> = entries.filter_map(|e| e.ok().map(|e| e.path())).collect();
    paths.retain(|p| !file_name(p).starts_with('.'));
    paths.sort();
    Ok(paths)
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

fn write_if_changed(path: &Path, bytes: &[u8]) -> Result<(), String> {
    if fs::read(path).is_ok_and(|old| old == bytes) {
        return Ok(());
    }
    fs::write(path, bytes).map_err(|e| format!("{}: {e}", path.display()))
}
