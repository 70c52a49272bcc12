//! Help, wrong options, and what ends a bake.

use std::path::Path;
use std::process::Output;

use crate::{cornell, lit_plates, run, texts};

#[test]
fn help_is_a_command_too() {
    let text = |command: &str, args: &[&str]| {
        let out = run(command, args);
        assert!(out.status.success(), "{command} {args:?}: {}", texts(&out)[1]);
        texts(&out)[0].clone()
    };
    assert_eq!(text("help", &[]), text("--help", &[]));
    for command in ["bake", "grid", "probes", "merge"] {
        assert_eq!(text("help", &[command]), text(command, &["--help"]));
    }
    let out = run("help", &["fry"]);
    assert!(out.status.code() == Some(2) && texts(&out)[1].contains("no command 'fry'"));
    for command in ["grid", "probes"] {
        let help = text(command, &["--help"]);
        assert!(help.contains("\n  --error X         how far off"), "{help}");
    }
    let help = text("bake", &["--help"]);
    assert!(help.contains("direction towards the sun"), "{help}");
}

#[test]
fn unknown_options_name_the_nearest_known_one() {
    for (command, option, meant) in [
        ("bake", "-o", "--out"),
        ("bake", "--erorr", "--error"),
        ("bake", "--max-element", "--max-elements"),
        ("bake", "--exposre", "--exposure"),
        ("grid", "--photo", "--photometric"),
        ("light-map", "--texl", "--texel"),
        ("verify", "--precison", "--precision"),
    ] {
        let out = run(command, &["a.obj", option]);
        let error = &texts(&out)[1];
        assert_eq!(out.status.code(), Some(2), "{error}");
        let words = format!("'{option}'; did you mean {meant}?");
        assert!(error.contains(&words), "{words} not in {error}");
    }
    let error = &texts(&run("bake", &["a.obj", "--quux"]))[1];
    assert!(error.contains("no option '--quux'") && !error.contains("did you mean"), "{error}");
}

#[test]
fn times_are_seconds() {
    for (command, time) in [("bake", "10s"), ("bake", "0"), ("bake", "-1"), ("verify", "10s")] {
        let out = run(command, &["a.obj", "b.ply", "--time", time]);
        let error = &texts(&out)[1];
        assert_eq!(out.status.code(), Some(2), "{error}");
        assert!(error.contains("--time") && error.contains("such as 10"), "{error}");
        assert!(error.contains(&format!("'{time}'")), "{error}");
    }
}

/// Bakes `scene` to `stem`, with its report.
fn bake(scene: &str, stem: &Path, more: &[&str]) -> (Output, serde_json::Value) {
    let mut args = vec![scene, "--out", stem.to_str().unwrap(), "--cpu", "--write", "json"];
    args.extend(more);
    let out = run("bake", &args);
    assert!(out.status.success(), "{}", texts(&out)[1]);
    let json = std::fs::read(stem.with_added_extension("json")).unwrap();
    (out, serde_json::from_slice(&json).unwrap())
}

#[test]
fn an_error_and_a_time_are_until_either() {
    let folder = tempfile::tempdir().unwrap();
    let stem = folder.path().join("box");
    for option in ["--error", "--error-each"] {
        let key = option.trim_start_matches("--").replace('-', "_");
        // Hours of work, if the time did not end it.
        let (out, json) = bake(cornell(), &stem, &[option, "0.00001", "--time", "1"]);
        assert_eq!(json["goal"], serde_json::json!({ (key.as_str()): 1e-5, "seconds": 1.0 }));
        assert_eq!(json["outcome"], "missed: the time was up");
        assert_eq!(json["stopped"], false);
        let said = &texts(&out)[0];
        let last = said.lines().last().unwrap();
        assert!(last.contains("missed: the time was up (about "), "{said}");
        assert!(last.contains("more than --time 1,"), "{said}");
        // What a bake to an error that fits into the time reached, and not the start of another.
        assert!(json["error"]["total"].as_f64().unwrap() < 0.3, "{said}");
        // The other way round: the error ends it.
        let (_, json) = bake(cornell(), &stem, &["--time", "600", option, "0.5"]);
        assert_eq!(json["goal"], serde_json::json!({ (key.as_str()): 0.5, "seconds": 600.0 }));
        assert_eq!(json["outcome"], "reached");
    }
    let out = run("bake", &["a.obj", "--error", "0.1", "--error-each", "0.2"]);
    let error = &texts(&out)[1];
    assert!(out.status.code() == Some(2) && error.contains("give one"), "{error}");
}

#[test]
fn a_bake_without_a_target_says_how_to_give_one() {
    let folder = tempfile::tempdir().unwrap();
    let scene = lit_plates(folder.path());
    let (out, _) = bake(scene.to_str().unwrap(), &folder.path().join("lit"), &[]);
    let said = &texts(&out)[0];
    let last = said.lines().last().unwrap();
    assert_eq!(last, "no error asked for: --error 0.05 goes on until 5 %");
}
