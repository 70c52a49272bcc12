//! How many rows are asked for at once: progress is reported between batches, so the work of one
//! is bounded whatever the settings.

use radiosity::backend::cpu::RayRows;
use radiosity::{FormFactors, Mesh};

use crate::common::cube;
use crate::common::scenes::grey;

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
