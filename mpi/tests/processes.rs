//! Runs of several processes, by `mpirun`.

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

const PROGRAM: &str = env!("CARGO_BIN_EXE_radiosity-mpi");
const CORNELL_BOX: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenes/cornell_box.obj");

/// `mpirun` with so many processes of a thread each.
fn mpirun(processes: usize, args: &[&str]) -> Child {
    let mut command = Command::new("mpirun");
    command.args(["--oversubscribe", "-x", "RAYON_NUM_THREADS=1", "-n", &processes.to_string()]);
    // Open MPI refuses to run as root otherwise, as it does in containers.
    for name in ["OMPI_ALLOW_RUN_AS_ROOT", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM"] {
        command.env(name, "1");
    }
    command.arg(PROGRAM).args(args).stderr(Stdio::null()).stdout(Stdio::null());
    command.spawn().expect("mpirun is installed")
}

/// What `processes` write to a file with these arguments.
fn written(processes: usize, args: &[&str]) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let args = [args, &["--out", out.to_str().unwrap()]].concat();
    assert!(mpirun(processes, &args).wait().unwrap().success());
    std::fs::read(out).unwrap()
}

#[test]
fn any_number_of_processes_write_the_same_bytes() {
    let args = ["view-factors", CORNELL_BOX, "--facets", "--two-sided", "light"];
    let alone = written(1, &args);
    for processes in [2, 4] {
        assert!(written(processes, &args) == alone, "{processes} processes");
    }
}

/// An OBJ file of `count`² boxes of unlike heights.
fn town(count: u32) -> String {
    let mut text = String::new();
    for house in 0..count * count {
        let (x, y) = (3 * (house % count), 3 * (house / count));
        let z = 1 + house * 7 % 5;
        for (x, y, z) in [(x, y, 0), (x + 2, y, 0), (x + 2, y + 2, 0), (x, y + 2, 0)]
            .into_iter()
            .chain([(x, y, z), (x + 2, y, z), (x + 2, y + 2, z), (x, y + 2, z)])
        {
            text += &format!("v {x} {y} {z}\n");
        }
        text += "f -4 -3 -2 -1\nf -8 -7 -3 -4\nf -7 -6 -2 -3\nf -6 -5 -1 -2\nf -5 -8 -4 -1\n";
    }
    text
}

/// A process of the program that has `word` among its arguments.
fn process_with(word: &str) -> Option<u32> {
    let has_word = |pid: &u32| {
        let line = std::fs::read_to_string(format!("/proc/{pid}/cmdline")).unwrap_or_default();
        line.starts_with(PROGRAM) && line.contains(word)
    };
    let entries = std::fs::read_dir("/proc").unwrap();
    let numbers = entries.filter_map(|e| e.unwrap().file_name().to_str()?.parse().ok());
    numbers.filter(has_word).max()
}

#[test]
fn process_that_dies_ends_the_run_and_its_checkpoint_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let (scene, rows, out) = (path("town.obj"), path("town.rows"), path("killed.npz"));
    std::fs::write(&scene, town(6)).unwrap();
    let args = ["view-factors", &scene, "--facets"];
    let mut run = mpirun(2, &[&args[..], &["--checkpoint", &rows, "--out", &out]].concat());
    while !Path::new(&rows).exists() {
        assert!(run.try_wait().unwrap().is_none(), "it ended before there was a checkpoint");
        std::thread::sleep(Duration::from_millis(20));
    }
    let victim = process_with(&rows).expect("two processes are at work");
    assert!(Command::new("kill").args(["-9", &victim.to_string()]).status().unwrap().success());
    assert!(!run.wait().unwrap().success());
    assert!(!Path::new(&out).exists());
    let alone = written(1, &args);
    let kept = std::fs::metadata(&rows).unwrap().len();
    assert!(written(2, &[&args[..], &["--checkpoint", &rows]].concat()) == alone);
    assert!(std::fs::metadata(&rows).unwrap().len() > kept, "rows were left to make");
}
