//! View factors from rows of elements.

use radiosity::view_factor::Missing;
use radiosity::{Mesh, RayRows, ViewFactors, load_obj};

use crate::common::keep_counting;
use crate::common::view_factors::{data, exact_view_factors};

#[test]
fn sampled_factors_estimate_their_errors() {
    // Against the exact matrix of a cube with a box inside; 4096 rays a row, elements of an eighth.
    let scene = load_obj(data("view_factors/occ-box-centred-w_x0-w_y0.obj")).unwrap();
    let truth = exact_view_factors(&scene, 1e-4);
    let mesh = Mesh::new(scene, 0.18).unwrap();
    let mut rays = RayRows::new(&mesh, 4096).unwrap();
    let m = ViewFactors::sampled(&mesh, &mut rays, keep_counting).unwrap().unwrap();
    assert_eq!(m.absent, Missing::NotSeen);
    let (mut within, mut count, mut worst) = (0, 0, 0.0_f64);
    for i in 0..m.names.len() {
        for f in &truth.factors[i] {
            let got = m.factor(i, f.to as usize);
            let off = (got.value - f.value).abs();
            count += 1;
            within += usize::from(off <= 2.0 * got.error.hypot(f.error));
            worst = worst.max(off);
        }
    }
    println!("{within} of {count} within two estimates, worst {worst:.1e}");
    assert!(within * 10 >= count * 7, "{within} of {count}");
    // Neighbouring walls are seen from a sixteenth away at the nearest: up to 0.02.
    assert!(worst < 0.02, "{worst}");
    let checks = m.checks();
    assert!(checks.closure.max < 1e-8, "shares are whole numbers of 2^-32");
    assert!(checks.reciprocity.max > 1e-5, "rays are not reciprocal: {checks:?}");

    let (enforced, correction) = m.enforced();
    let after = enforced.checks();
    println!("{correction:?}");
    assert!(after.reciprocity.max < 1e-14, "{after:?}");
    assert!(after.closure.max < 1e-12 && correction.closure_left < 1e-12, "{after:?}");
    assert_eq!(after.bounds.max, 0.0);
    assert!(
        correction.max_change > 0.0
            && correction.max_change < 0.02
            && correction.rms_change <= correction.max_change
    );
    for (i, row) in enforced.factors.iter().enumerate() {
        let total = row.iter().map(|f| f.value).sum::<f64>() + enforced.back[i].value;
        assert!(total + enforced.open[i].value <= 1.0 && row.iter().all(|f| f.value >= 0.0));
    }
}
