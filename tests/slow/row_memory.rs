//! Memory for rows changes how often rows are made, not the light.

use radiosity::{Mesh, Solver};

use crate::common::closed_forms::exact;
use crate::common::scenes::paint;
use crate::common::{cube, keep_going};

#[test]
#[ignore = "slow"]
fn row_memory_changes_work_not_light() {
    let mesh = Mesh::new(cube(&paint(0.8, 1.0)), 0.36).unwrap();
    let solve = |row_memory: usize| {
        let mut maker = exact();
        let settings =
            Solver { unshot: 1e-3, row_memory, patch_tolerance: 0.0, ..Default::default() };
        let s = settings.solve(&mesh, &mut maker, keep_going).unwrap();
        assert_eq!(maker.made, s.rows_made);
        s
    };
    let (kept, half, none) = (solve(1 << 30), solve(200_000), solve(0));
    assert_eq!(kept.rows_made as usize, mesh.element_count(), "each row once");
    assert_eq!(none.rows_made, none.shots, "nothing kept, all made again");
    assert!(kept.rows_made < half.rows_made && half.rows_made < none.rows_made);
    // The order of shots may differ with what is at hand; the light may not.
    for s in [half, none] {
        for (a, b) in kept.radiosity.iter().zip(&s.radiosity) {
            // Both within the unshot share of the same solution.
            assert!(((*a - *b) / *a).abs().max_element() < 1e-2);
        }
    }
}
