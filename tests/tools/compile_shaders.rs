//! Compiles the shaders that differ between two trees of shaders, for programs that load them at run time (feature `replaceable-shaders`).
//!
//! `compile_shaders BASE TREE OUT`: `BASE` and `TREE` are folders like `shaders-glsl`. For each shader whose text (with includes) is another one
//! in `TREE`, the module is written to `OUT`, under the name that `build.rs` gives it. Exit code 1: a shader does not compile. 3: an interface or an
//! exported constant is another one, so that the host code must be built again.

#[path = "../../engine/shader/compile.rs"]
mod compile;
#[path = "../../engine/shader/reflect.rs"]
#[allow(dead_code)]
mod reflect;

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::ExitCode,
};

const USAGE: &str = "usage: compile_shaders BASE TREE OUT";

/// All files below a folder of shaders, as `folder/name`.
fn files(root: &Path) -> Result<Vec<String>, String> {
    let list = |folder: &Path| -> Result<Vec<PathBuf>, String> {
        let entries = fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
        Ok(entries.filter_map(|entry| Some(entry.ok()?.path())).collect())
    };
    let mut found = Vec::new();
    for folder in list(root)?.iter().filter(|path| path.is_dir()) {
        let name = |path: &Path| path.strip_prefix(root).map(|p| p.to_string_lossy().into_owned()).unwrap_or_default();
        found.extend(list(folder)?.iter().map(|path| name(path)));
    }
    found.sort();
    Ok(found)
}

/// The text of a shader with its includes, without the place of its tree.
fn text(root: &Path, file: &str) -> String {
    compile::closure(root, file).replace(&root.display().to_string(), "")
}

/// The lines with constants for the host.
fn exports(root: &Path, file: &str) -> Vec<String> {
    let text = fs::read_to_string(root.join(file)).unwrap_or_default();
    text.lines().filter(|line| line.trim_end().ends_with("// export")).map(str::to_owned).collect()
}

/// Compiles one variant of a shader in both trees. `None` if its interface is another one.
fn module(base: &Path, tree: &Path, file: &str, query: bool) -> Result<Option<Vec<u8>>, String> {
    let kind = match file.rsplit('.').next() {
        Some("comp") => shaderc::ShaderKind::Compute,
        Some("vert") => shaderc::ShaderKind::Vertex,
        _ => shaderc::ShaderKind::Fragment,
    };
    let compiled = compile::compile(tree, file, kind, query)?;
    let before = compile::compile(base, file, kind, query)?;
    let interface = |words: &[u32]| reflect::reflect(words).map_err(|error| format!("{file}: {error}"));
    Ok((interface(&compiled.reflect)? == interface(&before.reflect)?).then_some(compiled.ship))
}

fn run(base: &Path, tree: &Path, out: &Path) -> Result<ExitCode, String> {
    let mut written = 0;
    for file in files(tree)? {
        if file.ends_with(".glsl") {
            if exports(base, &file) != exports(tree, &file) {
                println!("{file}: an exported constant is another one");
                return Ok(ExitCode::from(3));
            }
            continue;
        }
        if text(base, &file) == text(tree, &file) {
            continue;
        }
        for query in [false, true] {
            if query && !compile::traces(tree, &file) {
                continue;
            }
            let Some(bytes) = module(base, tree, &file, query)? else {
                println!("{file}: another interface");
                return Ok(ExitCode::from(3));
            };
            let name = file.replace('/', ".") + if query { ".query.spv" } else { ".spv" };
            fs::write(out.join(&name), bytes).map_err(|error| format!("{name}: {error}"))?;
            written += 1;
        }
    }
    println!("{written} modules");
    Ok(ExitCode::SUCCESS)
}

fn main() -> ExitCode {
    let args: Vec<PathBuf> = env::args_os().skip(1).map(PathBuf::from).collect();
    let [base, tree, out] = &args[..] else {
        eprintln!("{USAGE}");
        return ExitCode::from(2);
    };
    run(base, tree, out).unwrap_or_else(|message| {
        eprintln!("{message}");
        ExitCode::from(1)
    })
}
