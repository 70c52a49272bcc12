//! Effort follows the flux at stake: coarse rows for patches that shoot little.

use radiosity::backend::cpu::RayRows;
use radiosity::form_factor::{ProximityCorrection, Row};
use radiosity::mesh::NodeId;
use radiosity::{Error, FormFactors, Material, Mesh, Rgb, Solution, Solver};

use crate::common::{cornell_box, keep_going, quads};

/// Shares of the emitted flux for which rows are made at full resolution, half and a quarter: a
/// halving is enough for 2^2.5 = 5.7 times less light.
pub const FULL: f64 = 0.1;

pub const SHARES: [f64; 3] = [FULL, FULL / 6.0, FULL / 33.0];

pub fn some_elements(mesh: &Mesh) -> Vec<NodeId> {
    (0..20).map(|k| mesh.element(k * 97 % mesh.element_count())).collect()
}

#[test]
fn dim_patches_get_fewer_rays() {
    let mesh = cornell_box(200.0);
    let patches = some_elements(&mesh);
    let make = |n: u32| RayRows::new(&mesh, n).unwrap().with_full_share(FULL);
    for (full, counts) in [(8192, [8192, 2048, 512]), (600, [600, 256, 256]), (10, [10, 10, 10])] {
        let mut maker = make(full);
        for k in [0, 1, 2] {
            let rows = maker.rows(&mesh, &patches, SHARES[k]).unwrap();
            rows.iter().zip(&patches).for_each(|(row, &p)| row.check(&mesh, p).unwrap());
            assert!(rows == make(counts[k]).rows(&mesh, &patches, 1.0).unwrap(), "{full} {k}");
            assert!(rows.iter().all(|row| row.entries.len() as u32 <= counts[k]), "{full} {k}");
        }
        let all = make(full).rows(&mesh, &patches, 1.0).unwrap();
        assert!(maker.with_full_share(0.0).rows(&mesh, &patches, 1e-9).unwrap() == all);
    }
}

/// Sends all light away and notes how much was said to be at stake, and for how many patches.
#[derive(Default)]
struct Told(Vec<(f64, usize)>);

impl FormFactors for Told {
    fn rows(&mut self, _: &Mesh, patches: &[NodeId], share: f64) -> Result<Vec<Row>, Error> {
        self.0.push((share, patches.len()));
        Ok(vec![Row { escaped: Row::TOTAL, ..Default::default() }; patches.len()])
    }

    fn preferred_batch_len(&self) -> usize {
        3
    }
}

/// A lamp of two triangles that shine red, one of two that shine half as much in red and alone in
/// green, one that is dim; each triangle an element.
fn lamps() -> Mesh {
    let square = |x: f64| [[x, 0., 0.], [x + 1., 0., 0.], [x + 1., 1., 0.], [x, 1., 0.]];
    let lamp = |exitance| Material { exitance, ..Material::grey("lamp", 0.0) };
    let (red, both) = (Rgb::new(4.0, 0.0, 0.0), Rgb::new(2.0, 1.0, 0.0));
    let dim = Rgb::new(0.4, 0.0, 0.0);
    let scene =
        quads(&[(square(0.), lamp(red)), (square(2.), lamp(both)), (square(4.), lamp(dim))]);
    Mesh::new(scene, 2.0).unwrap()
}

#[test]
fn solver_asks_with_the_largest_unshot_share_of_a_batch() {
    let mesh = lamps();
    let mut told = Told::default();
    Solver { unshot: 0.0, ..Default::default() }.solve(&mesh, &mut told, keep_going).unwrap();
    // Of red, a triangle has 4, 2 and 0.4 of 2·6.4; of green the second lamp's have half. A batch
    // is three patches, or fewer where light falls to a quarter.
    let want = [(0.5, 3), (4.0 / 12.8, 1), (0.4 / 12.8, 2)];
    assert_eq!(told.0.len(), 3, "{:?}", told.0);
    for (told, want) in told.0.iter().zip(want) {
        assert!((told.0 - want.0).abs() < 1e-12 && told.1 == want.1, "{told:?} {want:?}");
    }
}

#[test]
fn wrappers_pass_importance_on() {
    let mesh = cornell_box(200.0);
    let mut rows = ProximityCorrection::new(Told::default(), &mesh, 1.0);
    rows.rows(&mesh, &[mesh.root(0)], 0.125).unwrap();
    let told = &rows.inner().0;
    assert!(!told.is_empty() && told.iter().all(|&(share, _)| share == 0.125), "{told:?}");
}

/// A solution whose energy is accounted for and whose bits are those of a second run, and its rows.
pub fn solve<M: FormFactors>(
    mesh: &Mesh,
    make: impl Fn() -> M,
) -> (Solution, ProximityCorrection<M>) {
    let solve = || {
        let mut rows = ProximityCorrection::new(make(), mesh, 1.0);
        let solution = Solver::default().solve(mesh, &mut rows, keep_going).unwrap();
        (solution, rows)
    };
    let ((one, rows), (again, _)) = (solve(), solve());
    assert!(one.radiosity == again.radiosity && one.ledger == again.ledger);
    assert!(one.ledger.imbalance() <= 1e-9, "{}", one.ledger.imbalance());
    (one, rows)
}

#[test]
fn mixed_ray_counts_conserve_energy_and_bits() {
    let mesh = cornell_box(100.0);
    let rays = || RayRows::new(&mesh, 4096).unwrap();
    let (some, all) = (solve(&mesh, rays).0, solve(&mesh, || rays().with_full_share(0.0)).0);
    assert!(some.radiosity != all.radiosity);
}
