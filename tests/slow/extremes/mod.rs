//! Quantities over their whole ranges against what is known exactly, on hemicubes and on rays: the
//! ends and the middle of every range. All steps, as tables (many minutes with lavapipe):
//!
//!     RADIOSITY_ALL_STEPS=1 cargo test --release --test slow extremes -- --ignored --nocapture

mod sweep;
mod sweeps;

use radiosity::Backend;
use radiosity::backend::AdapterInfo;

const HEADER: &str = "\
| quantity | range | steps | compared with | off | may be | NaN, ∞ | ledger | by |
|---|---|---|---|---|---|---|---|---|";

/// Goes through every sweep and prints a table; fails with the sweeps that do not hold.
fn sweep_with(device: &Backend) {
    let all = std::env::var_os("RADIOSITY_ALL_STEPS").is_some();
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
#[ignore = "slow"]
fn rays_hold_over_all_ranges() {
    sweep_with(&Backend::Cpu);
}

#[test]
#[ignore = "slow"]
#[cfg(not(skip_gpu_tests))]
fn hemicubes_hold_over_all_ranges() {
    sweep_with(&Backend::Gpu(crate::common::gpu()));
}

#[test]
#[ignore = "slow"]
fn gmres_needs_few_products_in_white_furnace() {
    // Light that fills the scene evenly is one direction: found in a product. What is left are 48
    // elements' own, in 48 at most; shares of 2⁻³² that differ, not light, are what takes more than
    // one.
    let ask = sweeps::Ask { device: &Backend::Cpu, all: true };
    let s = sweeps::reflectance_of_furnace(&ask).unwrap();
    assert!(s.steps >= 12 && s.off <= 1e-4 && s.most <= 48, "{s:?}");
}
