//! Verification report: cases with known answers in one table and one page of plots. Writes
//! `docs/verification.md` and `docs/verification.png`, and fails if a case is outside its band:
//!
//!     cargo run --release --features cli --example verification
//!
//! Everything is computed with rays on the CPU; the numbers are the same for any number of threads.

mod case;
mod cie_171;
mod furnace;
mod grids;
mod heat;
mod luminaires;
mod path_traced;
mod plot;
mod points;
mod report;
mod sky;
mod view_factors;

#[path = "../../src/bin/radiosity"]
mod program {
    #[allow(dead_code, reason = "a part of it is used")]
    pub mod canvas;
}
#[allow(dead_code, reason = "a part of it is used")]
#[path = "../../tests/common/scenes.rs"]
mod scenes;
#[path = "../../tests/common/truth.rs"]
mod truth;

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use case::Section;

/// Whatever goes wrong ends the program with its message.
type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

fn main() -> Result<ExitCode> {
    let makers: [fn() -> Result<Section>; 8] = [
        furnace::section,
        view_factors::section,
        heat::section,
        cie_171::section,
        sky::section,
        grids::section,
        luminaires::section,
        path_traced::section,
    ];
    let mut sections = vec![];
    for make in makers {
        let start = std::time::Instant::now();
        let section = make()?;
        eprintln!("{}: {} s", section.title, start.elapsed().as_secs());
        sections.push(section);
    }
    std::fs::write(file("docs/verification.md"), report::markdown(&sections))?;
    std::fs::write(file("docs/verification.png"), plot::png(&sections)?)?;
    let cases = sections.iter().flat_map(|section| &section.cases);
    let failed: Vec<_> = cases.clone().filter(|case| !case.is_passed()).collect();
    for case in &failed {
        let case::Case { name, quantity, right, here, band, .. } = case;
        println!("FAILED: {name}, {quantity}: {here}, right {right} ± {band}");
    }
    let count = cases.count();
    println!("{} of {count} cases passed", count - failed.len());
    Ok(if failed.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// A file of the repository.
fn file(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// A progress callback that never stops the work.
fn go<T>(_: &T) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// The same for callbacks with how much is done, of how much.
fn go_on<N>(_: N, _: N) -> ControlFlow<()> {
    ControlFlow::Continue(())
}
