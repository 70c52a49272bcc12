//! A process that is killed while it solves goes on from its last saved state, to the same bytes.
//!
//! The program is started and killed again and again, each time after it has saved a state:
//!
//! ```text
//! start -> saves -> killed,  start -> resumes -> saves -> killed,  …,  start -> resumes -> ends
//! ```

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, SystemTime};

/// Starts `radiosity bake` of the Cornell box on the CPU, with files called `out`.
fn bake(method: &str, state: Option<&Path>, out: &Path) -> Child {
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell_box.obj");
    let mut command = Command::new(env!("CARGO_BIN_EXE_radiosity"));
    command.args(["bake", scene, "--cpu", "--set", &format!("method={method}"), "--out"]).arg(out);
    command.args([
        "--set",
        "solve.element_size=80",
        "--set",
        "hemicube_resolution=32",
        "--set",
        "unshot=1e-5",
    ]);
    // 1 MiB holds a part of the rows.
    command.args(["--set", "row_memory=1048576"]);
    if let Some(state) = state {
        command.arg("--state").arg(state);
    }
    command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
}

fn last_saved(state: &Path) -> Option<SystemTime> {
    std::fs::metadata(state).and_then(|file| file.modified()).ok()
}

#[test]
#[ignore = "slow"]
fn killed_process_resumes_to_the_same_bytes() {
    // G. Marsaglia's xorshift64, any seed.
    let mut random = 0x2545_f491_4f6c_dd1du64;
    for (method, kills) in [("shooting", 10), ("gauss-seidel", 5), ("gmres", 5)] {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let state = path("light.state");
        assert!(bake(method, None, &path("undisturbed")).wait().unwrap().success());
        let mut interrupted = 0;
        for _ in 0..kills {
            let before = last_saved(&state);
            let mut child = bake(method, Some(&state), &path("resumed"));
            while last_saved(&state) == before && child.try_wait().unwrap().is_none() {
                std::thread::sleep(Duration::from_millis(1));
            }
            random ^= random << 13;
            random ^= random >> 7;
            random ^= random << 17;
            // At whatever moment comes: in the middle of a batch, or while it saves again.
            std::thread::sleep(Duration::from_millis(random % 100));
            interrupted += u32::from(child.try_wait().unwrap().is_none());
            child.kill().unwrap();
            child.wait().unwrap();
            assert!(state.exists(), "{method}: a state was saved before the kill");
        }
        assert!(bake(method, Some(&state), &path("resumed")).wait().unwrap().success());
        println!("{method}: {interrupted} of {kills} kills came before the end");
        let [undisturbed, resumed] =
            ["undisturbed.ply", "resumed.ply"].map(|name| std::fs::read(path(name)).unwrap());
        assert!(undisturbed == resumed, "{method}");
    }
}
