//! The modules of the engine import one another in one direction.

use crate::common;
use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::Path,
};

/// The first names in `use crate::…` and in paths `crate::name::…`, without those of unit tests.
fn imports(text: &str) -> BTreeSet<String> {
    let text = text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default();
    let code: String =
        text.lines().filter(|line| !line.trim_start().starts_with("//")).map(|l| format!("{l}\n")).collect();
    let mut found = BTreeSet::new();
    for rest in code.split("crate::").skip(1) {
        let Some(list) = rest.strip_prefix('{') else {
            found.insert(rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect());
            continue;
        };
        let (mut depth, mut name, mut names) = (0, String::new(), Vec::new());
        for c in list.chars() {
            match c {
                '{' => depth += 1,
                '}' if depth == 0 => break,
                '}' => depth -= 1,
                ',' if depth == 0 => names.push(std::mem::take(&mut name)),
                _ if depth == 0 => name.push(c),
                _ => {}
            }
        }
        names.push(name);
        let first = |name: &String| name.trim().split("::").next().unwrap_or_default().to_owned();
        found.extend(names.iter().map(first).filter(|name| !name.is_empty()));
    }
    found
}

/// The modules that each module of the engine imports. `codegen` writes code of `shaders`, whose imports are named below.
fn edges() -> BTreeMap<String, BTreeSet<String>> {
    fn collect(folder: &Path, module: Option<&str>, edges: &mut BTreeMap<String, BTreeSet<String>>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let stem = path.file_stem().unwrap().to_string_lossy().into_owned();
            let name = module.map_or(stem.clone(), str::to_owned);
            if path.is_dir() {
                collect(&path, Some(&name), edges);
            } else if path.extension().is_some_and(|e| e == "rs")
                && !["lib", "codegen"].contains(&stem.as_str())
                && !stem.ends_with("tests")
            {
                edges.entry(name).or_default().extend(imports(&fs::read_to_string(&path).unwrap()));
            }
        }
    }
    let mut edges = BTreeMap::new();
    collect(&common::root().join("engine"), None, &mut edges);
    // The generated modules of shaders name handles of the graph; `crate::Result` and the like are no modules.
    edges.insert("shaders".to_owned(), BTreeSet::from(["graph".to_owned(), "shader".to_owned()]));
    let modules: BTreeSet<String> = edges.keys().cloned().collect();
    for (module, imported) in &mut edges {
        imported.retain(|name| name != module && modules.contains(name));
    }
    edges
}

#[test]
fn names_are_found_in_every_form_of_import() {
    let text = "use crate::scene::Scene;\nuse crate::{\n    Error,\n    gpu::{self, Gpu},\n    graph,\n};\n// crate::image\n\
        fn f() { crate::bake::run() }\n#[cfg(test)]\nmod tests {\n    use crate::measure;\n}\n";
    let expected = ["Error", "bake", "gpu", "graph", "scene"].map(str::to_owned);
    assert_eq!(imports(text), BTreeSet::from(expected));
}

#[test]
fn modules_do_not_import_one_another_in_circles() {
    let mut edges = edges();
    assert!(edges.len() > 15 && edges["techniques"].contains("graph"), "{edges:?}");
    // Modules that import none of those left are taken away until none is left.
    loop {
        let free: Vec<String> =
            edges.iter().filter(|(_, imported)| imported.is_empty()).map(|(m, _)| m.clone()).collect();
        if free.is_empty() {
            break;
        }
        edges.retain(|module, _| !free.contains(module));
        edges.values_mut().for_each(|imported| imported.retain(|name| !free.contains(name)));
    }
    assert!(edges.is_empty(), "modules that import one another in a circle, or one of those: {edges:#?}");
}

/// A file of tests that no program names would never run.
#[test]
fn every_file_of_tests_is_in_one_program() {
    let tests = common::root().join("tests");
    let read = |path: &Path| fs::read_to_string(path).unwrap();
    let mut said = read(&common::root().join("Cargo.toml")) + &read(&common::root().join("samples/Cargo.toml"));
    for entry in fs::read_dir(tests.join("programs")).unwrap() {
        said += &read(&entry.unwrap().path()).replace("\"../", "\"tests/");
    }
    let mut count = 0;
    for folder in [tests.clone(), tests.join("cli")] {
        for path in fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).filter(|path| path.is_file()) {
            let name = path.strip_prefix(common::root()).unwrap().to_string_lossy().into_owned();
            if path.extension().is_some_and(|e| e == "rs") && read(&path).contains("#[test]")
                || name.ends_with("malformed.rs")
            {
                let times =
                    said.matches(&format!("\"{name}\"")).count() + said.matches(&format!("\"../{name}\"")).count();
                assert_eq!(times, 1, "{name} is in {times} programs of tests");
                count += 1;
            }
        }
    }
    assert!(count > 100, "{count} files");
}
