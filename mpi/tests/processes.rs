//! Runs of several processes, by `mpirun`: Open MPI's or MPICH's.

use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

const PROGRAM: &str = env!("CARGO_BIN_EXE_radiosity-mpi");
const CORNELL_BOX: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenes/cornell_box.obj");

/// `mpirun` with so many processes of a thread each.
fn mpirun(processes: usize, args: &[&str]) -> Command {
    let mut command = Command::new("mpirun");
    command.env("RAYON_NUM_THREADS", "1").args(["-n", &processes.to_string()]);
    // Open MPI refuses to run as root otherwise, as it does in containers, and more processes than
    // there are cores.
    for name in ["OMPI_ALLOW_RUN_AS_ROOT", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM"] {
        command.env(name, "1");
    }
    command.env("OMPI_MCA_rmaps_base_oversubscribe", "1");
    command.env("PRTE_MCA_rmaps_default_mapping_policy", ":oversubscribe");
    command.arg(PROGRAM).args(args).stdin(Stdio::null());
    command
}

fn start(processes: usize, args: &[&str]) -> Child {
    let mut command = mpirun(processes, args);
    command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("mpirun is installed")
}

/// The file of this name that `processes` write with these arguments, and what they print.
fn written(processes: usize, args: &[&str], name: &str) -> (Vec<u8>, Output) {
    let folder = tempfile::tempdir().unwrap();
    let args = [args, &["--out", folder.path().to_str().unwrap()]].concat();
    let printed = mpirun(processes, &args).output().expect("mpirun is installed");
    assert!(printed.status.success(), "{}", String::from_utf8_lossy(&printed.stderr));
    (std::fs::read(folder.path().join(name)).unwrap(), printed)
}

#[test]
fn any_number_of_processes_write_the_same_bytes() {
    let commands: [(&[&str], &str); 5] = [
        (&["bake", "--cpu", "--error", "0.1", "--write", "ply"], "ply"),
        (&["light-map", "--cpu", "--error", "0.2", "--size", "64"], "light-map.exr"),
        (&["grid", "--cpu", "--error", "0.1", "--height", "300", "--spacing", "100"], "grid.csv"),
        (&["probes", "--cpu", "--error", "0.2", "--spacing", "200"], "probes.csv"),
        (&["view-factors", "--facets", "--format", "npz"], "npz"),
    ];
    for (args, ending) in commands {
        let (args, name) = ([args, &[CORNELL_BOX]].concat(), format!("cornell_box.{ending}"));
        let (alone, _) = written(1, &args, &name);
        for processes in [2, 3] {
            let (bytes, printed) = written(processes, &args, &name);
            assert!(bytes == alone, "{} by {processes} processes", args[0]);
            let text = String::from_utf8(printed.stdout).unwrap();
            let first = text.lines().next().unwrap();
            let times = text.lines().filter(|line| *line == first).count();
            assert_eq!(times, 1, "one process prints: {text}");
        }
    }
}

#[test]
fn wrong_usage_is_said_once() {
    for args in [&["roast", CORNELL_BOX][..], &["bake", "no_such_file.obj"]] {
        let output = mpirun(2, args).output().unwrap();
        assert!(!output.status.success());
        let errors = String::from_utf8(output.stderr).unwrap();
        assert_eq!(errors.matches("error: ").count(), 1, "{errors}");
    }
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
fn process_that_dies_ends_the_run_and_its_state_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let (state, out) = (path("box.state"), path("killed"));
    let args = ["bake", CORNELL_BOX, "--cpu", "--error", "0.01", "--write", "ply"];
    let mut run = start(2, &[&args[..], &["--state", &state, "--out", &out]].concat());
    let kept = || std::fs::metadata(&state).map_or(0, |file| file.len());
    while kept() < 1 << 16 {
        assert!(run.try_wait().unwrap().is_none(), "it ended before there was a state");
        std::thread::sleep(Duration::from_millis(20));
    }
    let victim = process_with(&state).expect("two processes are at work");
    assert!(Command::new("kill").args(["-9", &victim.to_string()]).status().unwrap().success());
    assert!(!run.wait().unwrap().success());
    assert!(!Path::new(&format!("{out}.ply")).exists());
    let left = kept();
    let (alone, _) = written(1, &args, "cornell_box.ply");
    let (resumed, _) = written(2, &[&args[..], &["--state", &state]].concat(), "cornell_box.ply");
    assert!(resumed == alone);
    assert!(kept() > left, "there was work left");
}
