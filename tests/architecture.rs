//! What each module of `src` may know, as ARCHITECTURE.md says: read from the sources themselves.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Each module at the root of the crate, and the others that its files may name.
const MAY_KNOW: &[(&str, &str)] = &[
    ("error", ""),
    ("progress", "error"),
    ("work", "error progress"),
    ("geometry", ""),
    ("whole_file", ""),
    ("linear", ""),
    ("sampling", "error geometry"),
    ("scene", "error geometry"),
    ("accuracy", "error geometry"),
    ("visibility", "error geometry sampling scene work"),
    ("light", "error geometry progress sampling scene visibility work"),
    ("glare", "error geometry light sampling scene"),
    ("mesh", "error geometry sampling scene visibility work"),
    ("hemicube", "error form_factor geometry"),
    ("form_factor", "error geometry mesh scene"),
    ("solver", "error form_factor geometry linear mesh progress scene visibility whole_file work"),
    ("vertex", "error form_factor geometry mesh scene"),
    (
        "gather",
        "accuracy error form_factor geometry linear mesh progress sampling scene vertex \
         visibility work",
    ),
    ("path_correction", "accuracy error gather light progress sampling scene visibility work"),
    ("grid", "error gather geometry path_correction scene visibility"),
    ("daylight", "error gather light progress sampling scene visibility work"),
    ("probe", "error gather path_correction progress scene visibility work"),
    ("view_factor", "error form_factor geometry progress sampling scene visibility work"),
    ("heat", "error geometry linear view_factor"),
    (
        "backend",
        "accuracy error form_factor gather geometry hemicube light mesh progress sampling scene \
         visibility",
    ),
    ("camera", "error gather geometry mesh progress sampling scene vertex visibility work"),
    ("verify", "accuracy error geometry light progress sampling scene vertex visibility work"),
    (
        "bake",
        "accuracy backend error form_factor gather geometry light mesh progress sampling \
         scene solver verify vertex visibility work",
    ),
    ("bands", "accuracy backend bake error gather linear mesh scene vertex"),
    (
        "light_map",
        "accuracy backend bake error gather geometry mesh path_correction progress sampling \
         scene vertex visibility work",
    ),
    (
        "kept_mesh",
        "backend bake error gather mesh path_correction progress scene vertex visibility work",
    ),
    ("io", "bands camera error gather geometry light_map mesh scene vertex view_factor whole_file"),
];

/// Files below `folder`, the program's left out: it is a user of the library.
fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            if !path.ends_with("bin") {
                sources(&path, found);
            }
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

/// The library's files: path below `src`, and code without comments and unit tests.
fn library() -> Vec<(String, String)> {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = vec![];
    sources(&src, &mut files);
    let code = |path: &PathBuf| {
        let text = fs::read_to_string(path).unwrap();
        let text = text.split("#[cfg(test)]\nmod tests").next().unwrap().to_string();
        let lines = text.lines().map(|line| line.split("//").next().unwrap());
        lines.collect::<Vec<_>>().join("\n")
    };
    let name = |path: &PathBuf| path.strip_prefix(&src).unwrap().display().to_string();
    files.iter().map(|path| (name(path), code(path))).collect()
}

/// The root module that a file belongs to: `solver` for `solver.rs` and `solver/gmres.rs`.
fn room(file: &str) -> &str {
    file.split(['/', '.']).next().unwrap()
}

/// Root modules that `code` names, as `crate::room` or in `use crate::{room, …}`.
fn named(code: &str) -> BTreeSet<&str> {
    let rooms = MAY_KNOW.iter().map(|(room, _)| *room);
    let paths = rooms.filter(|room| {
        let path = format!("crate::{room}");
        code.match_indices(&path).any(|(at, _)| {
            !code[at + path.len()..].starts_with(|c: char| c.is_alphanumeric() || c == '_')
        })
    });
    paths.collect()
}

#[test]
fn modules_name_only_what_they_may_know() {
    let allowed: BTreeMap<&str, Vec<&str>> =
        MAY_KNOW.iter().map(|(room, may)| (*room, may.split_whitespace().collect())).collect();
    let mut wrong = vec![];
    let files = library();
    assert!(files.len() > 60, "the sources are found: {}", files.len());
    for (file, code) in files.iter().filter(|(file, _)| file != "lib.rs") {
        let Some(may) = allowed.get(room(file)) else {
            wrong.push(format!("src/{file}: in no module of the table"));
            continue;
        };
        assert!(
            !code.contains("use crate::{"),
            "src/{file}: one path a use, so that this test reads it"
        );
        let names =
            named(code).into_iter().filter(|name| *name != room(file) && !may.contains(name));
        wrong.extend(names.map(|name| format!("src/{file}: names crate::{name}")));
    }
    assert!(wrong.is_empty(), "against ARCHITECTURE.md:\n{}", wrong.join("\n"));
}

/// A module is built before those that may know it: no circle is possible between rooms.
#[test]
fn table_has_no_circles() {
    let mut placed: BTreeSet<&str> = BTreeSet::new();
    while placed.len() < MAY_KNOW.len() {
        let next = MAY_KNOW.iter().find(|(room, may)| {
            !placed.contains(room) && may.split_whitespace().all(|m| placed.contains(m))
        });
        let (room, _) = next.expect("some module that knows only those before it");
        placed.insert(room);
    }
}

#[test]
fn wgpu_is_named_in_its_own_module_only() {
    for (file, code) in library() {
        let inside = file.starts_with("backend/gpu");
        for name in ["wgpu::", "naga::"] {
            assert!(inside || !code.contains(name), "src/{file} names {name}");
        }
    }
}

#[test]
fn files_are_opened_by_few_modules_only() {
    let others = ["solver/checkpoint.rs", "whole_file.rs", "work/journal.rs"];
    for (file, code) in library() {
        let may = file.starts_with("io") || others.contains(&&*file);
        assert!(may || !code.contains("std::fs"), "src/{file} opens files");
    }
}

/// Of the standard library it panics in browsers.
#[test]
fn the_clock_is_named_in_one_module_only() {
    for (file, code) in library() {
        let reads = ["Instant,", "Instant;", "Instant}", "SystemTime"];
        let reads = reads.iter().any(|name| code.contains(&format!("std::time::{name}")));
        let reads = reads || code.contains("std::time::{Duration, Instant}");
        assert!(!reads, "src/{file} reads a clock: take crate::progress::Instant");
    }
}

/// Without `mod`, cargo leaves a file of tests out and says nothing.
#[test]
fn every_file_of_tests_is_a_module() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests");
    let mut files = vec![];
    sources(&folder, &mut files);
    let read = |path: &Path| fs::read_to_string(path).unwrap_or_default();
    let roots: String = ["library.rs", "slow.rs"].map(|root| read(&folder.join(root))).concat();
    for file in files.iter().filter(|file| file.parent() != Some(&folder)) {
        let parent = file.parent().unwrap();
        let (name, above) = match file.file_stem().unwrap().to_str().unwrap() {
            "main" => continue,
            "mod" => (parent.file_name().unwrap(), parent.parent().unwrap()),
            _ => (file.file_stem().unwrap(), parent),
        };
        let own = ["mod.rs", "main.rs"].map(|file| read(&above.join(file))).concat();
        let line = format!("mod {};", name.to_str().unwrap());
        assert!(format!("{own}{roots}").contains(&line), "no `{line}` for {}", file.display());
    }
}
