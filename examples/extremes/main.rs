//! Quantities swept over their whole ranges, against what is known exactly, as a table.
//!
//!     cargo run --release --example extremes [-- --cpu]
//!
//! HemicubeRows on the graphics adapter, or rays with `--cpu`. Fails where a deviation is larger than it
//! may be, a number is not finite or a ledger does not close.

#[path = "../../tests/common/mod.rs"]
mod common;
mod files;
mod scenes;
mod sweep;
mod sweeps;

use std::process::ExitCode;

use radiosity::{Backend, Error};
use sweeps::Ask;

fn main() -> ExitCode {
    match run() {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(e) => {
            eprintln!("error: {e}");
            ExitCode::FAILURE
        }
    }
}

/// Prints the table; whether all holds.
fn run() -> Result<bool, Error> {
    let device = match std::env::args().nth(1).as_deref() {
        None => Backend::gpu(None)?,
        Some("--cpu") => Backend::Cpu,
        Some(other) => {
            eprintln!("usage: extremes [--cpu], not {other}");
            return Ok(false);
        }
    };
    println!("{}", device.adapter().join(", "));
    println!("| quantity | range | steps | compared with | off | may be | NaN, ∞ | ledger | by |");
    println!("|---|---|---|---|---|---|---|---|---|");
    let ask = Ask { device: &device, all: true };
    let mut all_hold = true;
    for sweep in sweeps::ALL {
        let s = sweep(&ask)?;
        let ledger = s.ledger.map_or("–".into(), |l| format!("{l:.0e}"));
        let most = if s.most > 0 { format!(", {} steps at most", s.most) } else { String::new() };
        println!(
            "| {} | {} | {} | {} | {:.0e} | {:.0e} | {} | {ledger} | {}{most} |",
            s.quantity, s.range, s.steps, s.known, s.off, s.within, s.not_finite, s.by
        );
        all_hold &= s.holds();
    }
    Ok(all_hold)
}
