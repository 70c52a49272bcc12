//! How many rows are asked for at once: progress is reported between batches, so the work of one
//! is bounded whatever the settings.

use std::num::NonZeroU32;

use radiosity::form_factor::{AdaptiveViewpoints, ProximityCorrection};
use radiosity::{FormFactors, HemicubeRows, Mesh, RayRows};

use crate::common::scenes::grey;
use crate::common::{cube, gpu};

fn mesh() -> Mesh {
    Mesh::new(cube(&grey()), 0.3).unwrap()
}

#[test]
fn rows_of_many_rays_come_in_small_batches() {
    let mesh = mesh();
    let batch_len = |rays| RayRows::new(&mesh, rays).unwrap().preferred_batch_len();
    // 2^20 rays at most in a batch, and 16 rows at most.
    assert_eq!([1 << 10, 1 << 18, 1 << 20].map(batch_len), [16, 4, 1]);
}

#[test]
fn rows_from_several_viewpoints_come_one_by_one() {
    let mesh = mesh();
    let batch_len = |levels| {
        let rays = RayRows::new(&mesh, 64).unwrap();
        let corrected = ProximityCorrection::new(rays, &mesh, 1.0);
        AdaptiveViewpoints::new(corrected, 0.1, levels).preferred_batch_len()
    };
    // Without levels as many as the rays come in; else a patch may take 16 views or more.
    assert_eq!([0, 1, u32::MAX].map(batch_len), [16, 1, 1]);
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn rows_of_many_rotations_come_in_small_batches() {
    let (gpu, mesh) = (gpu(), mesh());
    let batch_len = |rotations: u32| {
        let hemicubes = HemicubeRows::new(&gpu, &mesh, 64).unwrap();
        hemicubes.with_rotations(NonZeroU32::new(rotations).unwrap()).preferred_batch_len()
    };
    // 16 hemicubes of 64 pixels are drawn at once; a row is one for each rotation.
    assert_eq!([1, 4, 16, 100].map(batch_len), [16, 4, 1, 1]);
}
