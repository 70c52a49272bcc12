//! Bakes choose between hemicubes and rays.

use radiosity::backend::{AdapterKind, RowMaker};
use radiosity::{Backend, BakeSettings, Scene};

use crate::common::measures::assert_same_bits;
use crate::common::scenes::cut_into_four;
use crate::common::{cornell_box, gpu, keep_going};

/// The Cornell box: 32 triangles.
fn coarse() -> Scene {
    cornell_box(f64::INFINITY).scene().clone()
}

/// The same in 8192.
fn fine() -> Scene {
    (0..4).fold(coarse(), |scene, _| cut_into_four(&scene))
}

/// On a software device hemicubes draw few triangles; many are left to rays, which are those of the
/// CPU to the bit. Hardware casts those too.
#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn bakes_of_tessellated_scenes_cast_rays_on_software_devices() {
    let gpu = gpu();
    let is_software = gpu.adapter().kind == AdapterKind::Cpu;
    let many = if is_software { RowMaker::Rays } else { RowMaker::DeviceRays };
    let device = Backend::Gpu(gpu);
    for (scene, maker) in [(coarse(), RowMaker::Hemicubes), (fine(), many)] {
        let mut settings = BakeSettings::for_error(0.3, &scene);
        settings.solve.hemicube_resolution = 64;
        settings.gather = None;
        let [baked, again, by_cpu] = [&device, &device, &Backend::Cpu]
            .map(|backend| settings.bake(scene.clone(), backend, keep_going).unwrap());
        assert_eq!(device.row_maker(&scene, 64), maker);
        assert_eq!((baked.row_maker, by_cpu.row_maker), (maker, RowMaker::Rays));
        assert!(baked.device_failure.is_none());
        assert_eq!(baked.hemicubes, again.hemicubes);
        assert_same_bits(&baked.solution, &again.solution);
        let drawn: u64 = baked.hemicubes_by_resolution.iter().map(|h| h.1).sum();
        match maker {
            RowMaker::Hemicubes => assert_eq!(drawn, baked.hemicubes),
            RowMaker::DeviceRays => assert!(baked.hemicubes_by_resolution.is_empty()),
            RowMaker::Rays => {
                assert!(baked.hemicubes_by_resolution.is_empty());
                assert_eq!(baked.hemicubes, by_cpu.hemicubes);
                assert_same_bits(&baked.solution, &by_cpu.solution);
                let [light, cpu] = [&baked, &by_cpu].map(|baked| &baked.light.surface);
                assert!(light.radiosity == cpu.radiosity && light.error == cpu.error);
            }
        }
    }
}
