//! `--preview`: files of a bake that is under way.

use std::path::Path;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::Duration;

use radiosity::io::read_ply;

use crate::{cornell, refused};

/// Light is there to be looked at long before the end, and that of the end takes its place.
#[test]
fn light_can_be_looked_at_while_the_bake_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let stem = folder.path().join("box").display().to_string();
    let [ply, glb] = ["ply", "glb"].map(|ending| format!("{stem}.{ending}"));
    let is_preview = || {
        let comments = read_ply(Path::new(&ply)).unwrap().comments;
        comments.iter().any(|comment| comment.contains("preview"))
    };
    // A minute of work, all of which is needed only where there is no preview.
    let mut program = Command::new(env!("CARGO_BIN_EXE_radiosity"));
    program.args(["bake", cornell(), "--cpu", "--time", "60", "--preview"]);
    program.args(["--write", "ply,glb", "--out", &stem]);
    let mut child = program.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    while !Path::new(&glb).exists() {
        assert!(child.try_wait().unwrap().is_none(), "the bake goes on");
        sleep(Duration::from_millis(10));
    }
    assert!(is_preview() && std::fs::read(&glb).unwrap().starts_with(b"glTF"));
    let id = child.id().to_string();
    assert!(Command::new("kill").args(["-TERM", &id]).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(!is_preview());
    // Nothing else is left of any of them.
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
}

#[test]
fn a_preview_needs_a_mesh_to_write() {
    let words = ["--preview", "add ply or glb to --write"];
    refused(&[cornell(), "--cpu", "--preview", "--write", "json,png"], &words);
    refused(&[cornell(), "--cpu", "--preview", "--keep-mesh"], &["--preview", "--keep-mesh"]);
}
