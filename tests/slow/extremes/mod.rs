//! Quantities over their whole ranges against what is known exactly, on hemicubes and on rays: the
//! ends and the middle of every range. All steps, as tables (many minutes with lavapipe):
//!
//!     cargo test --release --test slow -- --ignored --nocapture in_all_steps

mod sweep;
mod sweeps;

use radiosity::{AdapterInfo, Backend};

const HEADER: &str = "\
| quantity | range | steps | compared with | off | may be | NaN, ∞ | ledger | by |
|---|---|---|---|---|---|---|---|---|";

/// Goes through every sweep and prints a table; fails with the sweeps that do not hold.
fn sweep_with(device: &Backend, all: bool) {
    let AdapterInfo { name, kind, driver } = device.adapter();
    println!("{name}, {kind}, {driver}\n{HEADER}");
    let ask = sweeps::Ask { device, all };
    let mut broken = vec![];
    for sweep in sweeps::ALL {
        let swept = sweep(&ask).unwrap();
        println!("{swept}");
        if !swept.holds() {
            broken.push(swept);
        }
    }
    assert!(broken.is_empty(), "{broken:#?}");
}

#[test]
fn rays_hold_over_all_ranges() {
    sweep_with(&Backend::Cpu, false);
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn hemicubes_hold_over_all_ranges() {
    sweep_with(&Backend::Gpu(crate::common::gpu()), false);
}

#[test]
#[ignore = "goes through all steps, in many minutes"]
fn rays_hold_in_all_steps() {
    sweep_with(&Backend::Cpu, true);
}

#[test]
#[ignore = "goes through all steps, in many minutes"]
fn hemicubes_hold_in_all_steps() {
    sweep_with(&Backend::Gpu(crate::common::gpu()), true);
}

#[test]
fn gmres_needs_few_products_in_white_furnace() {
    // Light that fills the scene evenly is one direction: found in a product. What is left are 48
    // elements' own, in 48 at most; shares of 2⁻³² that differ, not light, are what takes more than one.
    let ask = sweeps::Ask { device: &Backend::Cpu, all: true };
    let s = sweeps::reflectance_of_furnace(&ask).unwrap();
    assert!(s.steps >= 12 && s.off <= 1e-4 && s.most <= 48, "{s:?}");
}
