//! Gather points shared out between processes.

use radiosity::gather::{
    GatherPoint, IrradianceSample, RadiosityField, RefinementSettings, SharedGather,
    gather_at_vertices,
};
use radiosity::ranks::Ranks;
use radiosity::{Backend, Error, ErrorKind, Gather, GatheredMesh};

use crate::common::keep_going;
use crate::common::processes::{Thread, in_processes};
use crate::common::scenes::cornell_box;

/// What `drive` makes of a shared gatherer of `light` in process 0, of `size` processes.
fn driven<R: Send>(
    size: usize,
    light: &GatheredMesh,
    gatherer: impl Fn(usize) -> Box<dyn Gather> + Sync,
    drive: impl Fn(&mut dyn Gather) -> R + Sync,
) -> R {
    let results = in_processes(size, |ranks: &mut Thread| {
        let mut gatherer = gatherer(ranks.rank());
        if ranks.rank() == 0 {
            return Some(drive(&mut SharedGather::new(gatherer, light, ranks)));
        }
        SharedGather::serve(&mut gatherer, light, ranks);
        None
    });
    results.into_iter().flatten().next().unwrap()
}

/// The Cornell box by what it emits alone.
fn emitted() -> GatheredMesh {
    let mesh = cornell_box(200.0);
    let radiosity: Vec<_> = (0..mesh.element_count()).map(|e| mesh.exitance(e)).collect();
    GatheredMesh::from_elements(&mesh, &radiosity).unwrap()
}

/// One pass over the mesh of `light`, refined.
fn gathered(
    light: &GatheredMesh,
    passes: u32,
    gatherer: &mut dyn Gather,
) -> Result<Vec<f64>, Error> {
    let mut settings = RefinementSettings::new(50.0);
    settings.gather_passes = passes;
    let found = gather_at_vertices(light, &light.mesh, &settings, gatherer, keep_going)?;
    Ok(found.reflected.iter().flat_map(glam::DVec3::to_array).collect())
}

#[test]
fn gathered_light_has_the_same_bits_with_any_number_of_processes() {
    let light = emitted();
    let rays = |_| Backend::Cpu.gather(&light.mesh, 64).unwrap();
    let alone = gathered(&light, 1, &mut rays(0)).unwrap();
    assert!(alone.len() > 3 * light.reflected.len(), "elements were split");
    for size in [2, 3] {
        let shared = driven(size, &light, rays, |gatherer| gathered(&light, 1, gatherer));
        assert!(shared.unwrap() == alone, "{size} processes");
    }
}

#[test]
fn light_that_not_all_processes_have_is_refused() {
    let light = emitted();
    let rays = |_| Backend::Cpu.gather(&light.mesh, 64).unwrap();
    // The second pass gathers what the first has found.
    let error = driven(2, &light, rays, |gatherer| gathered(&light, 2, gatherer).unwrap_err());
    assert!(error.to_string().contains("another one than that of all processes"), "{error}");
}

#[test]
fn error_of_one_process_ends_the_gather() {
    #[derive(Debug)]
    struct Broken;
    impl Gather for Broken {
        fn gather(
            &mut self,
            _: &RadiosityField,
            _: &[GatherPoint],
        ) -> Result<Vec<IrradianceSample>, Error> {
            Err(Error::new(ErrorKind::Device, "device", "lost", "restart it"))
        }
    }
    let light = emitted();
    let gatherer = |rank| -> Box<dyn Gather> {
        if rank == 1 { Box::new(Broken) } else { Backend::Cpu.gather(&light.mesh, 64).unwrap() }
    };
    let error = driven(2, &light, gatherer, |gatherer| gathered(&light, 1, gatherer).unwrap_err());
    assert!(error.to_string().contains("process 1") && error.to_string().contains("lost"));
    assert!(error.is_device_error());
}
