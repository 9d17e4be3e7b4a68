//! GLSL to SPIR-V with includes. Errors name the file and the line, also inside includes.

use std::{
    fs,
    path::{Component, Path, PathBuf},
};

/// SPIR-V of one entry shader in two forms.
#[derive(Debug)]
pub struct Compiled {
    /// Unoptimised and with names: for reflection, so that an unused binding does not change the interface.
    pub reflect: Vec<u32>,
    /// Optimised: what ships.
    pub ship: Vec<u8>,
}

/// Defined in the variant of a shader that traces by ray query.
pub const QUERY_DEFINE: &str = "TRACE_QUERY";
/// Shaders that include this file are compiled in both variants.
pub const TRACE_FILE: &str = "lib/trace.glsl";

/// Whether `root/file` traces rays: it or something that it includes includes [`TRACE_FILE`].
pub fn traces(root: &Path, file: &str) -> bool {
    let path = root.join(TRACE_FILE).display().to_string();
    closure(root, file).lines().any(|line| line.strip_prefix("//// ") == Some(&path))
}

/// Includes deeper than this are taken for a cycle.
const MAX_INCLUDE_DEPTH: usize = 16;

/// The folder whose includes all other folders may use.
const SHARED: &str = "lib";
/// The folder that may use the includes of all others.
const TESTS: &str = "test";

/// Whether a file of folder `from` may include a file of folder `to`.
fn may_include(from: &str, to: &str) -> bool {
    to == SHARED || from == to || from == TESTS
}

/// Resolves `#include "name"`: from the root of the shader tree, or beside the file that includes it.
fn resolve(root: &Path, requesting: &str, name: &str) -> Result<(PathBuf, String), String> {
    if Path::new(name).components().any(|c| !matches!(c, Component::Normal(_))) {
        return Err(format!("#include \"{name}\": the path must stay inside {}", root.display()));
    }
    let beside = root.join(requesting).parent().map(|folder| folder.join(name));
    for path in [Some(root.join(name)), beside].into_iter().flatten() {
        if let Ok(text) = fs::read_to_string(&path) {
            let folder = |path: &Path| path.components().next().map(|c| c.as_os_str().to_string_lossy().into_owned());
            let (from, to) = (folder(Path::new(requesting)), folder(path.strip_prefix(root).unwrap_or(&path)));
            return match (from, to) {
                (Some(from), Some(to)) if !may_include(&from, &to) => Err(format!(
                    "#include \"{name}\": a file of {to}/ for the shaders of {to}/ alone; files that {from}/ needs too belong into {SHARED}/"
                )),
                _ => Ok((path, text)),
            };
        }
    }
    Err(format!("#include \"{name}\": no such file in {} or beside {requesting}", root.display()))
}

/// The text of `file` and of all it includes, for change detection. A missing include is left to the compiler to report.
pub fn closure(root: &Path, file: &str) -> String {
    let mut all = String::new();
    let mut open = vec![(file.to_owned(), 0)];
    while let Some((name, depth)) = open.pop() {
        let Ok((path, text)) = resolve(root, file, &name) else { continue };
        all.push_str(&format!("//// {}\n{text}\n", path.display()));
        if depth < MAX_INCLUDE_DEPTH {
            let includes = text.lines().filter_map(|line| line.trim_start().strip_prefix("#include"));
            open.extend(includes.filter_map(|rest| Some((rest.split('"').nth(1)?.to_owned(), depth + 1))));
        }
    }
    all
}

/// Compiles `root/file`; `query`: in the variant that traces by ray query.
///
/// # Errors
/// The compiler's message, each line as `path:line: error: …`.
pub fn compile(root: &Path, file: &str, kind: shaderc::ShaderKind, query: bool) -> Result<Compiled, String> {
    let path = root.join(file);
    let mut source = fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
    if source.trim().is_empty() {
        return Err(format!("{}: the file is empty", path.display()));
    }
    if query {
        // An extension must be named before the first declaration, and so cannot be named by an include.
        let version = source.find("#version").unwrap_or(0);
        let at = source[version..].find('\n').map_or(source.len(), |end| version + end);
        let next = source[..at].lines().count() + 1;
        source.insert_str(at, &format!("\n#extension GL_EXT_ray_query : require\n#line {next}"));
    }
    let include = |name: &str, requesting: &str| {
        let requesting = Path::new(requesting).strip_prefix(root).unwrap_or(Path::new(requesting));
        let (path, content) = resolve(root, &requesting.to_string_lossy(), name)?;
        Ok((path.display().to_string(), content))
    };
    let define = if query { Some(QUERY_DEFINE) } else { None };
    compile_text((&path.display().to_string(), &source), kind, (define, true), &include)
}

/// The name and the text of an include, by its name and that of the file that includes it.
pub type Include<'a> = dyn Fn(&str, &str) -> Result<(String, String), String> + 'a;

/// Compiles a text with the name that messages give it. `define`: a macro. `strict`: warnings are errors.
///
/// # Errors
/// The compiler's message, each line as `name:line: error: …`.
pub fn compile_text(
    (name, source): (&str, &str),
    kind: shaderc::ShaderKind,
    (define, strict): (Option<&str>, bool),
    include: &Include<'_>,
) -> Result<Compiled, String> {
    let compiler = shaderc::Compiler::new().map_err(|e| format!("cannot start shaderc: {e}"))?;
    let run = |ship: bool| -> Result<shaderc::CompilationArtifact, String> {
        let mut options = shaderc::CompileOptions::new().map_err(|e| format!("cannot start shaderc: {e}"))?;
        options.set_target_env(shaderc::TargetEnv::Vulkan, shaderc::EnvVersion::Vulkan1_3 as u32);
        if strict {
            options.set_warnings_as_errors();
        }
        if let Some(define) = define {
            options.add_macro_definition(define, None);
        }
        if ship {
            options.set_optimization_level(shaderc::OptimizationLevel::Performance);
        } else {
            options.set_optimization_level(shaderc::OptimizationLevel::Zero);
            options.set_generate_debug_info();
        }
        options.set_include_callback(|name, _, requesting, depth| {
            if depth > MAX_INCLUDE_DEPTH {
                return Err(format!(
                    "#include \"{name}\": includes are nested over {MAX_INCLUDE_DEPTH} deep; a cycle?"
                ));
            }
            let (resolved_name, content) = include(name, requesting)?;
            Ok(shaderc::ResolvedInclude { resolved_name, content })
        });
        compiler.compile_into_spirv(source, kind, name, "main", Some(&options)).map_err(|e| e.to_string())
    };
    let reflect = run(false)?.as_binary().to_vec();
    let ship = run(true)?.as_binary_u8().to_vec();
    Ok(Compiled { reflect, ship })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tree(files: &[(&str, &str)]) -> tempfile::TempDir {
        let dir = tempfile::tempdir().unwrap();
        for (name, text) in files {
            let path = dir.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        dir
    }

    const HEAD: &str = "#version 460\n#extension GL_GOOGLE_include_directive : require\n";

    #[test]
    fn an_error_inside_an_include_names_its_file_and_line() {
        let main = format!("{HEAD}#include \"lib/bad.glsl\"\nlayout(local_size_x = 1) in;\nvoid main() {{}}\n");
        let dir = tree(&[("a/x.comp", &main), ("lib/bad.glsl", "float ok;\nfloat f() { return undeclared; }\n")]);
        let error = compile(dir.path(), "a/x.comp", shaderc::ShaderKind::Compute, false).unwrap_err();
        assert!(error.contains("lib/bad.glsl:2: error: 'undeclared'"), "{error}");
    }

    #[test]
    fn an_include_cycle_ends_with_a_message() {
        let main = format!("{HEAD}#include \"lib/a.glsl\"\nlayout(local_size_x = 1) in;\nvoid main() {{}}\n");
        let dir = tree(&[("a/x.comp", &main), ("lib/a.glsl", "#include \"lib/a.glsl\"\n")]);
        let error = compile(dir.path(), "a/x.comp", shaderc::ShaderKind::Compute, false).unwrap_err();
        assert!(error.contains("cycle"), "{error}");
        assert!(closure(dir.path(), "a/x.comp").len() < 10_000);
    }

    #[test]
    fn includes_stay_inside_the_tree() {
        let main = format!("{HEAD}#include \"../secret.glsl\"\nlayout(local_size_x = 1) in;\nvoid main() {{}}\n");
        let dir = tree(&[("a/x.comp", &main)]);
        let error = compile(dir.path(), "a/x.comp", shaderc::ShaderKind::Compute, false).unwrap_err();
        assert!(error.contains("must stay inside"), "{error}");
    }

    #[test]
    fn includes_beside_a_techniques_shaders_are_its_own() {
        let main = |include: &str| {
            format!("{HEAD}#include \"{include}\"\nlayout(local_size_x = 1) in;\nvoid main() {{ float f = own(); }}\n")
        };
        let dir = tree(&[
            ("a/x.comp", &main("a/own.glsl")),
            ("a/beside.comp", &main("own.glsl")),
            ("test/x.comp", &main("a/own.glsl")),
            ("b/x.comp", &main("a/own.glsl")),
            ("b/through.comp", &main("lib/through.glsl")),
            ("a/own.glsl", "float own() { return 1.0; }\n"),
            ("lib/through.glsl", "#include \"a/own.glsl\"\n"),
        ]);
        let compile = |file: &str| compile(dir.path(), file, shaderc::ShaderKind::Compute, false).map(|_| ());
        for file in ["a/x.comp", "a/beside.comp", "test/x.comp"] {
            compile(file).unwrap_or_else(|error| panic!("{file}: {error}"));
        }
        let error = compile("b/x.comp").unwrap_err();
        assert!(error.contains("b/x.comp:3") && error.contains("files that b/ needs too belong into lib/"), "{error}");
        assert!(compile("b/through.comp").unwrap_err().contains("files that lib/ needs too"));
    }

    #[test]
    fn the_closure_changes_with_an_include() {
        let main = format!("{HEAD}#include \"lib/a.glsl\"\n");
        let dir = tree(&[("a/x.comp", &main), ("lib/a.glsl", "float a;\n")]);
        let before = closure(dir.path(), "a/x.comp");
        fs::write(dir.path().join("lib/a.glsl"), "float b;\n").unwrap();
        assert_ne!(before, closure(dir.path(), "a/x.comp"));
    }
}
