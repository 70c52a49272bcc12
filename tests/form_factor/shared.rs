//! Rows shared out between processes.

use radiosity::form_factor::{Row, SharedRows};
use radiosity::mesh::NodeId;
use radiosity::ranks::Ranks;
use radiosity::{Error, ErrorKind, FormFactors, Mesh, RayRows, Solver};

use crate::common::keep_going;
use crate::common::processes::{Thread, in_processes};
use crate::common::scenes::cornell_box;

/// What `drive` makes of shared rows in process 0, which `size` processes make.
fn driven<R: Send>(
    size: usize,
    mesh: &Mesh,
    source: impl Fn(usize) -> Box<dyn FormFactors> + Sync,
    drive: impl Fn(&mut dyn FormFactors) -> R + Sync,
) -> R {
    let results = in_processes(size, |ranks: &mut Thread| {
        let mut source = Boxed(source(ranks.rank()));
        if ranks.rank() == 0 {
            return Some(drive(&mut SharedRows::new(source, ranks)));
        }
        SharedRows::serve(&mut source, mesh, ranks);
        None
    });
    results.into_iter().flatten().next().unwrap()
}

struct Boxed(Box<dyn FormFactors>);

impl FormFactors for Boxed {
    fn rows(&mut self, mesh: &Mesh, patches: &[NodeId], weight: f64) -> Result<Vec<Row>, Error> {
        self.0.rows(mesh, patches, weight)
    }

    fn preferred_batch_len(&self) -> usize {
        self.0.preferred_batch_len()
    }

    fn fingerprint(&self) -> String {
        self.0.fingerprint()
    }
}

#[test]
fn light_has_the_same_bits_with_any_number_of_processes() {
    let mesh = cornell_box(150.0);
    let source = |_| -> Box<dyn FormFactors> { Box::new(RayRows::new(&mesh, 64).unwrap()) };
    let solve = |rows: &mut dyn FormFactors| {
        Solver::default().solve(&mesh, rows, keep_going).unwrap().radiosity
    };
    let alone = solve(&mut *source(0));
    for size in [2, 3] {
        assert!(driven(size, &mesh, source, solve) == alone, "{size} processes");
    }
}

#[test]
fn error_of_one_process_is_told_by_the_first() {
    struct Broken;
    impl FormFactors for Broken {
        fn rows(&mut self, _: &Mesh, _: &[NodeId], _: f64) -> Result<Vec<Row>, Error> {
            Err(Error::new(ErrorKind::Device, "device", "lost", "restart it"))
        }
    }
    let mesh = cornell_box(300.0);
    let source = |rank| -> Box<dyn FormFactors> {
        if rank == 1 { Box::new(Broken) } else { Box::new(RayRows::new(&mesh, 64).unwrap()) }
    };
    let solve = |rows: &mut dyn FormFactors| Solver::default().solve(&mesh, rows, keep_going);
    let error = driven(2, &mesh, source, |rows| solve(rows).map(|_| ()).unwrap_err());
    assert!(error.to_string().contains("process 1") && error.to_string().contains("lost"));
    assert!(error.is_device_error());
}
