//! Solves whose process is killed end with the bits of one that was not.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use radiosity::{Mesh, Method, RayRows, Rgb, Solution, SolveSession, Solver};

use crate::common::{cornell_box, keep_going};

/// The solve that is killed; some 2 s where rows are kept, a state every batch or every 16.
fn killed<'m>(mesh: &'m Mesh, rows: &RayRows, method: Method, path: &Path) -> SolveSession<'m> {
    let solver = Solver { unshot: 1e-5, row_memory: 1 << 20, ..Solver::new(method) };
    match path.exists() {
        true => solver.resume(mesh, rows, path).expect("the state is whole"),
        false => solver.begin(mesh).unwrap(),
    }
}

/// Not a test by itself: the process that is killed, told by the environment what to solve.
#[test]
fn the_process_that_is_killed() {
    let Some(path) = std::env::var_os("RADIOSITY_KILLED") else { return };
    let path = Path::new(&path);
    let method = std::env::var("RADIOSITY_METHOD").unwrap().parse().unwrap();
    let mesh = cornell_box(80.0);
    let mut rows = rays(&mesh);
    let mut solve = killed(&mesh, &rows, method, path);
    while solve.advance(&mut rows, keep_going).unwrap().is_none() {
        solve.save(path).unwrap();
    }
    std::fs::write(path.with_extension("done"), bits(&solve.into_solution().unwrap())).unwrap();
}

fn bits(s: &Solution) -> Vec<u8> {
    let bits = |b: &Rgb| b.to_array().map(f64::to_le_bytes).concat();
    s.radiosity.iter().flat_map(bits).collect()
}

#[test]
fn killed_process_resumes_to_the_same_bits() {
    let mesh = cornell_box(80.0);
    let mut random = 0x2545_f491_4f6c_dd1du64;
    for (method, kills) in [("shooting", 10), ("gauss-seidel", 5), ("gmres", 5)] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("light.state");
        let mut rows = rays(&mesh);
        let start = Instant::now();
        let mut whole = killed(&mesh, &rows, method.parse().unwrap(), Path::new("none"));
        whole.run(&mut rows, keep_going).unwrap();
        // A fresh process needs a while before its first batch; then a part of the whole.
        let most = start.elapsed().as_millis() as u64 / 2 + 200;
        let mut resumed = 0;
        for _ in 0..kills {
            let mut child = process(method, &path);
            random ^= random << 13;
            random ^= random >> 7;
            random ^= random << 17;
            std::thread::sleep(Duration::from_millis(random % most));
            child.kill().unwrap();
            child.wait().unwrap();
            resumed += u32::from(path.exists());
        }
        assert!(process(method, &path).wait().unwrap().success());
        let end = std::fs::read(path.with_extension("done")).unwrap();
        println!("{method}: killed {kills} times within {most} ms, {resumed} with a state");
        assert!(resumed > 0 && end == bits(&whole.into_solution().unwrap()), "{method}");
    }
}

fn process(method: &str, state: &Path) -> std::process::Child {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(["--exact", "the_process_that_is_killed"]);
    command.env("RADIOSITY_KILLED", state).env("RADIOSITY_METHOD", method);
    command.stdout(Stdio::null()).spawn().unwrap()
}

/// Rays, fewer for dim patches: rows depend on when they are made.
fn rays(mesh: &Mesh) -> RayRows {
    RayRows::new(mesh, 1024).unwrap()
}
