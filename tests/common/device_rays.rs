//! Light gathered with rays on a device, held against rays on the CPU.

use std::collections::HashMap;

use radiosity::backend::cpu::RayGather;
use radiosity::backend::gpu::TracedGather;
use radiosity::form_factor::Row;
use radiosity::gather::{GatherPoint, IrradianceSample, RadiosityField};
use radiosity::{Gather, Gpu, Rgb};

/// Rays over the hemisphere and their settings: both gatherers cast the same.
#[derive(Clone, Copy, Debug)]
pub struct Rays {
    pub count: u32,
    /// Allowed, as a share of the irradiance; infinite for `count` rays everywhere.
    pub noise: f64,
    /// Whether rays to lights are others on the CPU: to more lights than the device has rays of
    /// their own for.
    pub many_lights: bool,
}

/// Rays of a point that may go another way, in 32 bits: those that pass an edge within rounding, of
/// which there are fewer than one in a thousand.
pub const ODD_RAYS: f64 = 3.0;

/// What rounding may change where all rays go the same way: closed forms of lights are good to
/// 3e-5, sums of some thousand terms of 32 bits to less.
pub const ROUNDING: f64 = 1e-4;

/// What the device gathers at `points`, checked against the CPU. No ray carries more than `peak`,
/// W/m² in any channel.
pub fn same_as_on_the_cpu(
    gpu: &Gpu,
    field: &RadiosityField,
    points: &[GatherPoint],
    rays: Rays,
    peak: f64,
) -> Vec<IrradianceSample> {
    let Rays { count, noise, many_lights } = rays;
    let mut device = TracedGather::with_noise(gpu, field.mesh, count, noise, 0.0).unwrap();
    let mut cpu = RayGather::new(field.mesh, count).unwrap().with_noise(noise, 0.0);
    let found = device.gather(field, points).unwrap();
    assert!(device.gather(field, points).unwrap() == found, "the same bits twice");
    let expected = cpu.gather(field, points).unwrap();
    let ray = ODD_RAYS / f64::from(count);
    let (mut sums, mut noises) = ([Rgb::ZERO; 2], 0.0);
    for ((point, found), expected) in points.iter().zip(&found).zip(&expected) {
        let most = expected.irradiance.max_element();
        // Rays to lights are a quarter as many, and carry a part of the light each.
        let within = ray * peak + 4.0 * ray * expected.direct.max_element() + ROUNDING * most;
        let off = (found.irradiance - expected.irradiance).abs().max_element();
        assert!(off <= within, "{point:?}: {found:?}, on the CPU {expected:?}");
        let off = (found.direct - expected.direct).abs().max_element();
        assert!(off <= within, "{point:?}: {found:?}, on the CPU {expected:?}");
        assert!((found.escaped - expected.escaped).abs() <= ray, "{point:?}: {found:?}");
        assert!((found.backface - expected.backface).abs() <= ray, "{point:?}: {found:?}");
        sums[0] += found.irradiance;
        sums[1] += expected.irradiance;
        noises += found.noise.powi(2) + expected.noise.powi(2);
    }
    // Over all points what goes another way evens out.
    let scale = sums[1].max_element() + peak / f64::from(count);
    let off = (sums[0] - sums[1]).abs().max_element() / scale;
    let mut allowed = ROUNDING + 10.0 / (points.len() as f64 * f64::from(count));
    if many_lights {
        // Four standard errors, and those of lights on the CPU.
        allowed += 4.0 * noises.sqrt() / scale + 1e-3;
    }
    assert!(off <= allowed, "all together off by {off:e}");
    found
}

/// By how many of `rays` two rows differ: half of the sum of all differences.
pub fn rays_apart(a: &Row, b: &Row, rays: u32) -> f64 {
    let mut shares: HashMap<u32, f64> = HashMap::new();
    for (row, sign) in [(a, 1.0), (b, -1.0)] {
        let ends = [(u32::MAX, row.escaped), (u32::MAX - 1, row.backface)];
        for (item, share) in row.entries.iter().map(|e| (e.element, e.share)).chain(ends) {
            *shares.entry(item).or_default() += sign * Row::form_factor(share);
        }
    }
    // Shares are rounded to 2⁻³², and hardly change the count.
    0.5 * f64::from(rays) * shares.values().map(|d| d.abs()).sum::<f64>() - 1e-3
}
