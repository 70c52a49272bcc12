//! The whole range of every quantity: its ends and its middle, on hemicubes and on rays. The example
//! `extremes` goes all steps of the same sweeps.

mod sweep;
mod sweeps;

use radiosity::Backend;

/// Goes all sweeps, and names those that do not hold.
fn sweep_with(device: &Backend) {
    let ask = sweeps::Ask { device, all: false };
    let swept: Vec<_> = sweeps::ALL.iter().map(|sweep| sweep(&ask).unwrap()).collect();
    swept.iter().for_each(|s| println!("{s:?}"));
    let broken: Vec<_> = swept.iter().filter(|s| !s.holds()).collect();
    assert!(broken.is_empty(), "{broken:#?}");
}

#[test]
fn rays_hold_over_all_ranges() {
    sweep_with(&Backend::Cpu);
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn hemicubes_hold_over_all_ranges() {
    let gpu = crate::common::gpu();
    sweep_with(&Backend::Gpu(gpu));
}

#[test]
fn gmres_needs_few_products_in_white_furnace() {
    // Light that fills the scene evenly is one direction: found in a product. What is left are 48
    // elements' own, in 48 at most; shares of 2⁻³² that differ, not light, are what takes more than one.
    let ask = sweeps::Ask { device: &Backend::Cpu, all: true };
    let s = sweeps::reflectance_of_furnace(&ask).unwrap();
    assert!(s.steps >= 12 && s.off <= 1e-4 && s.most <= 48, "{s:?}");
}
