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
    assert!(out.status.code() == Some(2) && texts(&out)[1].contains("'fry'"));
    for command in ["grid", "probes"] {
        let help = text(command, &["--help"]);
        assert!(help.contains("--error <SHARE>") && help.contains("[default: 0.05]"), "{help}");
    }
    let help = text("bake", &["--help"]);
    assert!(help.contains("direction towards the sun"), "{help}");
}

#[test]
fn unknown_options_name_the_nearest_known_one() {
    for (command, option, meant) in [
        ("bake", "--erorr", "--error"),
        ("bake", "--transmitt", "--transmit"),
        ("bake", "--exposre", "--exposure"),
        ("grid", "--photometic", "--photometric"),
        ("light-map", "--texl", "--texel"),
        ("verify", "--precison", "--precision"),
    ] {
        let out = run(command, &["a.obj", option]);
        let error = &texts(&out)[1];
        assert_eq!(out.status.code(), Some(2), "{error}");
        let words = [format!("'{option}'"), format!("a similar argument exists: '{meant}'")];
        assert!(words.iter().all(|words| error.contains(words)), "{words:?} not in {error}");
    }
    let error = &texts(&run("bake", &["a.obj", "--quux"]))[1];
    assert!(error.contains("'--quux'") && !error.contains("similar"), "{error}");
    let error = &texts(&run("bake", &["a.obj", "--set", "max_element=9"]))[1];
    assert!(error.contains("such as gather.refinement.max_elements"), "{error}");
}

#[test]
fn times_are_seconds() {
    let verify = (&["verify", "a.obj", "b.ply"][..], "10s");
    for (args, time) in
        [(&["bake", "a.obj"][..], "10s"), (&["bake"], "0"), (&["bake"], "-1"), verify]
    {
        let out = run(args[0], &[&args[1..], &["--time", time]].concat());
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
    let json = std::fs::read(stem.with_added_extension("json")).unwrap();
    let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
    // Results are written in any case.
    let is_missed = json["outcome"].as_str().unwrap().starts_with("missed");
    assert_eq!(out.status.code(), Some(if is_missed { 3 } else { 0 }), "{}", texts(&out)[1]);
    (out, json)
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
    assert!(out.status.code() == Some(2) && error.contains("cannot be used with"), "{error}");
}

#[test]
fn a_bake_goes_to_5_per_cent_unless_something_else_is_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let scene = lit_plates(folder.path());
    let last = |more: &[&str]| {
        let (out, json) = bake(scene.to_str().unwrap(), &folder.path().join("lit"), more);
        let said = texts(&out)[0].clone();
        (json["goal"].clone(), said.lines().last().unwrap().to_string())
    };
    let (goal, said) = last(&[]);
    assert!(goal["error"] == 0.05 && said.starts_with("5 % reached"), "{goal} {said}");
    for more in [["--gather", "none"], ["--set", "solve.element_size=0.4"]] {
        let (goal, said) = last(&more);
        assert!(goal.is_null(), "{goal}");
        assert_eq!(said, "no error asked for: --error 0.05 goes on until 5 %");
    }
}

#[test]
fn settings_are_listed_with_the_options_that_help_leaves_out() {
    let out = run("bake", &["--list-settings"]);
    let [listed, error] = texts(&out);
    assert!(out.status.success() && error.is_empty(), "{error}");
    for words in [
        "gather.refinement.min_edge\n",
        "scene unit",
        "[1073741824]",
        "--state <FILE>",
        "--elements\n",
    ] {
        assert!(listed.contains(words), "'{words}' not in {listed}");
    }
    let help = &texts(&run("bake", &["--help"]))[0];
    assert!(!help.contains("--state <FILE>"), "{help}");
    assert!(help.lines().all(|line| line.chars().count() <= 100), "{help}");
}

#[test]
fn the_last_of_options_that_exclude_each_other_counts() {
    let folder = tempfile::tempdir().unwrap();
    let scene = lit_plates(folder.path());
    let sky = |more: &[&str]| {
        let (_, json) = bake(scene.to_str().unwrap(), &folder.path().join("lit"), more);
        json["sky"].clone()
    };
    let at = ["--sun-at=0,0,2026-03-20T12:07:30Z=10", "--sun=0,1,-1=3", "--gather", "none"];
    assert_eq!(
        sky(&[&["--sky", "2"], &at[..]].concat()),
        sky(&["--sky=2", "--sun", "0,1,-1=3", "--gather", "none"])
    );
    let cpu =
        bake(scene.to_str().unwrap(), &folder.path().join("lit"), &["--adapter", "x", "--cpu"]);
    assert_eq!(cpu.1["rows_by"], "rays");
}
