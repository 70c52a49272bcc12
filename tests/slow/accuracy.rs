//! The error that a bake estimates of itself, against path-traced truth.

use radiosity::accuracy::Measure;
use radiosity::{Backend, BakeResult, BakeTarget, Scene};

use crate::common::{cornell_box, keep_going, truth};

const TRUTH: &str = include_str!("../data/cornell_box.truth.json");

fn cornell() -> Scene {
    cornell_box(f64::INFINITY).scene().clone()
}

fn bake_to_error(scene: Scene, error: f64) -> BakeResult {
    BakeTarget::Error(error).bake(scene, &Backend::Cpu, keep_going).unwrap()
}

#[test]
#[ignore = "slow"]
fn error_target_is_reached_and_estimated() {
    for error in [0.1, 0.05, 0.02] {
        let baked = bake_to_error(cornell(), error);
        let (surface, said) = (&baked.light.surface, baked.estimate);
        let points = truth::points(TRUTH).unwrap();
        let found = points.iter().map(|p| truth::at(surface, p.position, p.normal).unwrap());
        let off: Vec<_> =
            points.iter().zip(found).map(|(p, (b, e))| (p, b.distance(p.radiosity), e)).collect();
        let area: Vec<_> = off.iter().filter(|o| o.0.kind == "area").collect();
        let bright = |(p, ..): &&(&truth::Point, f64, f64)| p.radiosity.length();
        let floor =
            Measure::default().floor * area.iter().map(bright).sum::<f64>() / area.len() as f64;
        let mut shares: Vec<f64> = area.iter().map(|o| o.1 / bright(o).max(floor)).collect();
        shares.sort_unstable_by(f64::total_cmp);
        // Without the tail: of 110 points the last does not count, and the one before it by 0.9.
        let kept = (1.0 - Measure::default().tail) * shares.len() as f64;
        let weights = (0..).map(|k| (kept - f64::from(k)).clamp(0.0, 1.0));
        let squares: f64 = shares.iter().zip(weights).map(|(e, weight)| weight * e * e).sum();
        let rms = (squares / kept).sqrt();
        let within = off.iter().filter(|(_, off, told)| *off <= 2.0 * told).count();
        println!(
            "asked {error}, off by {rms:.4}, told {:.4}, {within} of {} within two estimates",
            said.total,
            points.len()
        );
        // What a target is for: no worse than asked, and the estimate between half of it and
        // thrice.
        assert!(rms <= error && said.total <= error);
        assert!(said.total > 0.5 * rms && said.total < 3.0 * rms);
        // 95 % would be what two standard errors of a normal distribution hold; 198 points of a
        // share of 95 % scatter by 1.5 %, twice.
        assert!(within as f64 >= 0.92 * points.len() as f64);
        // The squares of the parts are that of the whole, rounded a few times each.
        let parts = [said.mesh, said.sampling, said.truncation, said.unshot, said.sources];
        let sum: f64 = parts.iter().map(|p| p * p).sum();
        assert!((sum.sqrt() - said.total).abs() < 1e-12, "{said:?}");
        assert_eq!(surface.error.len(), surface.positions.len());
        assert!(surface.error.iter().all(|e| e.is_finite() && *e >= 0.0));
    }
}
