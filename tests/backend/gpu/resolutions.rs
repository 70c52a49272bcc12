//! Rows for little light are drawn at a lower resolution.

use radiosity::FormFactors;
use radiosity::backend::gpu::HemicubeRows;

use crate::common::{cornell_box, gpu};
use crate::form_factor::resolution_policy::{FULL, SHARES, solve, some_elements};

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn dim_patches_get_smaller_hemicubes() {
    let gpu = gpu();
    let mesh = cornell_box(100.0);
    let patches = some_elements(&mesh);
    let make = |n: u32| HemicubeRows::new(&gpu, &mesh, n).unwrap().with_full_share(FULL);
    for (full, resolutions) in [(128, [128, 64, 32]), (36, [36, 18, 16]), (8, [8, 8, 8])] {
        let mut maker = make(full);
        // Back and forth, so that one resolution leaves nothing behind for another.
        for k in [0, 1, 2, 1, 0, 2] {
            let rows = maker.rows(&mesh, &patches, SHARES[k]).unwrap();
            rows.iter().zip(&patches).for_each(|(row, &p)| row.check(&mesh, p).unwrap());
            let alone = make(resolutions[k]).rows(&mesh, &patches, 1.0).unwrap();
            assert!(rows == alone, "{full}, halved {k} times: as of {}", resolutions[k]);
        }
        assert_eq!(maker.drawn(), 6 * patches.len() as u64);
    }
    let mut maker = make(128);
    maker.rows(&mesh, &patches[..5], SHARES[1]).unwrap();
    maker.rows(&mesh, &patches[..2], SHARES[2]).unwrap();
    assert_eq!(maker.drawn_by_resolution(), [(128, 0), (64, 5), (32, 2)]);
    let mut even = maker.with_full_share(0.0);
    even.rows(&mesh, &patches[..3], 1e-9).unwrap();
    assert_eq!(even.drawn_by_resolution(), [(128, 3), (64, 5), (32, 2)]);
    assert_eq!(make(16).drawn_by_resolution(), [(16, 0)], "nothing smaller");
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn mixed_resolutions_conserve_energy_and_bits() {
    let gpu = gpu();
    let mesh = cornell_box(60.0);
    let (solution, rows) = solve(&mesh, || HemicubeRows::new(&gpu, &mesh, 64).unwrap());
    let drawn = rows.inner().drawn_by_resolution();
    println!("{drawn:?}");
    assert!(drawn.iter().map(|d| d.0).eq([64, 32, 16]) && drawn.iter().all(|d| d.1 > 0));
    assert_eq!(rows.inner().drawn(), solution.rows_made);
}
