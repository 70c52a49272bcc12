//! What callers get from devices that fail: every failure is brought about, and answered by an
//! error or by smaller batches; what was solved by then stays.

use std::cell::RefCell;
use std::ops::ControlFlow;

use glam::DVec3;
use radiosity::backend::Fallback;
use radiosity::backend::cpu::{RayGather, RayRows};
use radiosity::backend::gpu::{GpuLimits, HemicubeRows, TracedGather, TracedRows};
use radiosity::bake::{BakeProgress, Outcome};
use radiosity::form_factor::Row;
use radiosity::gather::{
    GatherPoint, IrradianceSample, RadiosityField, RefinementSettings, gather_at_vertices,
};
use radiosity::mesh::NodeId;
use radiosity::scene::{Sides, SkyDistribution};
use radiosity::solver::{Method, StopReason};
use radiosity::verify::{Settings, verify};
use radiosity::{
    Backend, BakeSettings, BakeTarget, Error, ErrorKind, FormFactors, Gather, GatheredMesh, Gpu,
    Material, Mesh, Rgb, Sky, Solver, Sun,
};

use crate::common::scenes::{Quad, facing_up, paint, quads, walls};
use crate::common::{cornell_box, cube, gpu, keep_going};

/// Pixels along an edge with which hemicubes are drawn on software devices, too.
const MANY_PIXELS: u32 = 64;

/// The device as if it had no more than `limits`.
fn within(limits: GpuLimits) -> Gpu {
    Gpu::within(None, &limits).unwrap()
}

/// A glowing cube in some elements.
fn furnace() -> Mesh {
    let glow = Material { exitance: Rgb::ONE, ..Material::grey("glow", 0.5) };
    Mesh::new(cube(&glow), 0.3).unwrap()
}

/// Asks on until its device is closed, after so many times.
struct Doomed<T> {
    inner: T,
    gpu: Gpu,
    left: u32,
}

impl<T> Doomed<T> {
    fn count(&mut self) {
        match self.left {
            0 => self.gpu.close(),
            _ => self.left -= 1,
        }
    }
}

impl FormFactors for Doomed<HemicubeRows> {
    fn rows(&mut self, mesh: &Mesh, patches: &[NodeId], share: f64) -> Result<Vec<Row>, Error> {
        self.count();
        self.inner.rows(mesh, patches, share)
    }

    fn preferred_batch_len(&self) -> usize {
        self.inner.preferred_batch_len()
    }
}

impl Gather for Doomed<TracedGather> {
    fn gather(
        &mut self,
        sources: &RadiosityField,
        places: &[GatherPoint],
    ) -> Result<Vec<IrradianceSample>, Error> {
        self.count();
        self.inner.gather(sources, places)
    }
}

/// Hemicubes whose device is closed after so many batches.
fn doomed(gpu: &Gpu, mesh: &Mesh, left: u32) -> Doomed<HemicubeRows> {
    Doomed { inner: HemicubeRows::new(gpu, mesh, 64).unwrap(), gpu: gpu.clone(), left }
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn lost_device_is_an_error_everywhere() {
    let gpu = gpu();
    let mesh = furnace();
    let mut rows = HemicubeRows::new(&gpu, &mesh, 64).unwrap();
    let mut traced = TracedRows::new(&gpu, &mesh, 64).unwrap();
    let mut gather = TracedGather::new(&gpu, &mesh, 64).unwrap();
    let light = GatheredMesh::from_elements(&mesh, &vec![Rgb::ONE; mesh.element_count()]);
    let place =
        GatherPoint { position: [0.5; 3].into(), normal: [0.0, 0.0, 1.0].into(), near: 1e-3 };
    let mut drawn = BakeSettings::for_error(0.1, mesh.scene());
    drawn.solve.hemicube_resolution = MANY_PIXELS;
    gpu.close();
    let errors = [
        rows.rows(&mesh, &[mesh.element(0)], 1.0).unwrap_err(),
        rows.rows(&mesh, &[mesh.element(0)], 1.0).unwrap_err(),
        gather.gather(&light.unwrap().radiosity_field(), &[place]).unwrap_err(),
        traced.rows(&mesh, &[mesh.element(0)], 1.0).unwrap_err(),
        HemicubeRows::new(&gpu, &mesh, 64).unwrap_err(),
        TracedGather::new(&gpu, &mesh, 64).unwrap_err(),
        TracedRows::new(&gpu, &mesh, 64).unwrap_err(),
        Backend::Gpu(gpu.clone()).rows(&mesh, 64).unwrap_err(),
        drawn.bake(mesh.scene().clone(), &Backend::Gpu(gpu.clone()), keep_going).unwrap_err(),
    ];
    for e in errors {
        assert_eq!(e.kind(), ErrorKind::Device);
        let text = e.to_string();
        assert!(text.contains(&gpu.adapter().name) && text.contains("lost: closed"), "{text}");
    }
    // Another one is not concerned.
    assert!(HemicubeRows::new(&Gpu::new(None).unwrap(), &mesh, 64).is_ok());
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn solve_falls_back_with_the_same_bits() {
    let mesh = furnace();
    for method in [Method::ALL[0], Method::ALL[2], Method::ALL[4]] {
        let solver = Solver::new(method);
        let mut alone = HemicubeRows::new(&Gpu::new(None).unwrap(), &mesh, 64).unwrap();
        let undisturbed = solver.solve(&mesh, &mut alone, keep_going).unwrap();
        let lost = Gpu::new(None).unwrap();
        let e = solver.solve(&mesh, &mut doomed(&lost, &mesh, 2), keep_going).unwrap_err();
        assert_eq!(e.kind(), ErrorKind::Device);
        let (lost, errors) = (Gpu::new(None).unwrap(), RefCell::new(vec![]));
        let mut relay = Fallback::new(doomed(&lost, &mesh, 2), |e| {
            errors.borrow_mut().push(e);
            HemicubeRows::new(&Gpu::new(None)?, &mesh, 64)
        });
        let solution = solver.solve(&mesh, &mut relay, keep_going).unwrap();
        assert_eq!(solution.stop, StopReason::Converged);
        // Rows of the first device were used on, those of the second are the same: so is the light.
        assert!(solution.radiosity == undisturbed.radiosity, "{method}");
        assert_eq!(solution.rows_made, undisturbed.rows_made);
        let drawn = [relay.first().inner.drawn(), relay.second().unwrap().drawn()];
        assert_eq!(drawn.iter().sum::<u64>(), undisturbed.rows_made);
        assert!(drawn.iter().all(|d| *d > 0), "{drawn:?}");
        assert_eq!(
            errors.take().iter().map(radiosity::Error::kind).collect::<Vec<_>>(),
            [ErrorKind::Device]
        );
    }
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn fallback_passes_on_errors_of_no_device() {
    let gpu = gpu();
    let mesh = furnace();
    let mut relay = Fallback::new(doomed(&gpu, &mesh, 0), Err::<RayRows, _>);
    let e = relay.rows(&mesh, &[mesh.element(0)], 1.0).unwrap_err();
    assert_eq!(e.kind(), ErrorKind::Device);
    // What the caller has wrong another device has wrong as well.
    let other = Mesh::new(cube(&Material::grey("g", 0.5)), f64::INFINITY).unwrap();
    let gather = RayGather::new(&other, 16).unwrap();
    struct Wrong;
    impl Gather for Wrong {
        fn gather(
            &mut self,
            _: &RadiosityField,
            _: &[GatherPoint],
        ) -> Result<Vec<IrradianceSample>, Error> {
            Err(Error::new(ErrorKind::Setting, "sources", "wrong", "be right"))
        }
    }
    let mut spare = Some(gather);
    let mut relay = Fallback::new(Wrong, |_| Ok(spare.take().unwrap()));
    let light = GatheredMesh::from_elements(&other, &[Rgb::ONE; 12]).unwrap();
    assert_eq!(relay.gather(&light.radiosity_field(), &[]).unwrap_err().kind(), ErrorKind::Setting);
    assert!(relay.second().is_none());
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn gathering_falls_back_to_rays() {
    let gpu = gpu();
    let mesh = furnace();
    // Uneven, so that 64 rays and 1024 find nowhere the same.
    let uneven = |e: usize| Rgb::splat(2.0 + (e % 7) as f64);
    let radiosity: Vec<Rgb> = (0..mesh.element_count()).map(uneven).collect();
    let light = GatheredMesh::from_elements(&mesh, &radiosity).unwrap();
    // It is split whatever the light says, so that there are two batches.
    let settings = RefinementSettings {
        initial_subdivisions: 1,
        interpolation_tolerance: f64::INFINITY,
        ..RefinementSettings::new(1e-3)
    };
    let by = |gather: &mut dyn Gather| {
        gather_at_vertices(&light, &mesh, &settings, gather, keep_going).unwrap()
    };
    let on_device = by(&mut TracedGather::new(&gpu, &mesh, 64).unwrap());
    let rays = by(&mut RayGather::new(&mesh, 1024).unwrap());
    let inner = TracedGather::new(&gpu, &mesh, 64).unwrap();
    let doomed = Doomed { inner, gpu: gpu.clone(), left: 1 };
    let mut relay = Fallback::new(doomed, |_| RayGather::new(&mesh, 1024));
    let found = by(&mut relay);
    assert!(relay.second().is_some() && found.stop == StopReason::Converged);
    // What the device has gathered is there to the bit, and rays have gathered the rest.
    let same = |one: &GatheredMesh| -> Vec<bool> {
        let values = one.surface.radiosity.iter().zip(&found.surface.radiosity);
        values.map(|(a, b)| a == b).collect()
    };
    let (first, second) = (same(&on_device), same(&rays));
    assert!(first.iter().zip(&second).all(|(a, b)| *a != *b));
    assert!(first.contains(&true) && second.contains(&true));
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn bake_falls_back_and_reports_failure_once() {
    let scene = cornell_box(f64::INFINITY).scene().clone();
    // Closed while it shoots; the second is stopped when it hears of that.
    for stop in [false, true] {
        let gpu = Gpu::new(None).unwrap();
        let (mut told, mut calls, mut after) = (vec![], 0, 0);
        let drawn = |s: &mut BakeSettings| s.solve.hemicube_resolution = MANY_PIXELS;
        let baked = BakeTarget::Error(0.1)
            .bake_with(scene.clone(), &Backend::Gpu(gpu.clone()), drawn, |stage| {
                calls += 1;
                let works = matches!(stage, BakeProgress::Shooting(_) | BakeProgress::Gathering(_));
                after += u32::from(works && !told.is_empty());
                if calls == 40 {
                    gpu.close();
                }
                match stage {
                    BakeProgress::DeviceFailed(error) => {
                        told.push(error.clone());
                        if stop { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
                    }
                    _ => ControlFlow::Continue(()),
                }
            })
            .unwrap();
        let failure = baked.device_failure.expect("the device failed");
        assert_eq!(failure.kind(), ErrorKind::Device);
        assert_eq!(told.len(), 1, "it is told once");
        assert_eq!(told[0].to_string(), failure.to_string());
        assert!(baked.solution.ledger.imbalance() < 1e-9);
        if stop {
            assert_eq!(baked.solution.stop, StopReason::Cancelled);
            // What was reached is judged at the end, and nothing else is done.
            assert_eq!(after, 0);
        } else {
            assert_eq!(baked.solution.stop, StopReason::Converged);
            assert!(baked.estimate.total < 0.1, "{}", baked.estimate.total);
        }
        // Both devices have made rows: the hemicubes are those before the 40th call.
        let drawn: u64 = baked.hemicubes_by_resolution.iter().map(|h| h.1).sum();
        assert!(drawn > 0 && drawn < baked.hemicubes, "{drawn} of {}", baked.hemicubes);
    }
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn bakes_with_two_sides_and_a_sky_outlive_their_device() {
    // A room that is open to a clear sky and a sun, with a curtain, and a plate that both light.
    let towards_sun = DVec3::new(0.6, -0.5, 0.6);
    let zenith = Rgb::new(1.0, 1.5, 2.0);
    let clear = SkyDistribution::cie(12).unwrap();
    let sun = Sun { direction: towards_sun, irradiance: Rgb::new(30.0, 25.0, 20.0) };
    let sky = Sky::new(clear, zenith, DVec3::Z, towards_sun).unwrap().with_sun(sun).unwrap();
    let [west, _, rest @ ..] = walls([0.0; 3], [3.0, 2.0, 2.0]);
    let mut parts: Vec<(Quad, Material)> =
        [west].into_iter().chain(rest).map(|wall| (wall, paint(0.6, 0.0))).collect();
    let x = 2.8;
    let hanging = [[x, 0.1, 0.1], [x, 0.1, 1.6], [x, 1.2, 1.6], [x, 1.2, 0.1]];
    parts.push((hanging, Material { transmittance: Rgb::splat(0.4), ..paint(0.3, 0.0) }));
    let plate = facing_up([0.8, 1.6], [0.6, 1.4], 0.7);
    parts.push((plate, Material { sides: Sides::Auto, ..paint(0.5, 0.0) }));
    let scene = quads(&parts).with_sky(sky).unwrap();
    let gpu = Gpu::new(None).unwrap();
    let mut calls = 0;
    let drawn = |s: &mut BakeSettings| s.solve.hemicube_resolution = MANY_PIXELS;
    let baked = BakeTarget::Error(0.1)
        .bake_with(scene.clone(), &Backend::Gpu(gpu.clone()), drawn, |_| {
            calls += 1;
            if calls == 20 {
                gpu.close();
            }
            ControlFlow::Continue(())
        })
        .unwrap();
    assert_eq!(baked.device_failure.expect("the device failed").kind(), ErrorKind::Device);
    let drawn: u64 = baked.hemicubes_by_resolution.iter().map(|h| h.1).sum();
    assert!(drawn > 0 && drawn < baked.hemicubes, "{drawn} of {}", baked.hemicubes);
    assert!(baked.solution.ledger.imbalance() < 1e-9);
    assert_eq!(baked.outcome, Outcome::Reached);
    let found = verify(&scene, &baked.light.surface, &Settings::default(), keep_going).unwrap();
    let error = found.error.unwrap();
    assert!(error.value - 2.0 * error.standard_error < 0.1, "{error:?}");
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn little_memory_draws_same_rows_in_smaller_batches() {
    let gpu = gpu();
    let mesh = cornell_box(100.0);
    let patches: Vec<NodeId> = (0..40).map(|e| mesh.element(7 * e)).collect();
    let all = HemicubeRows::new(&gpu, &mesh, 128).unwrap().rows(&mesh, &patches, 1.0).unwrap();
    // A hemicube of 128 pixels is drawn on 128 × 384 × 4 bytes, which are copied once; the other
    // resolutions come on top. A batch of 16 takes more than 16 times that, one alone less than 4.
    let one: u64 = 2 * 128 * 384 * 4;
    let mut fits = vec![];
    for memory in (0..10).map(|k| (one / 16) << k) {
        let gpu = within(GpuLimits { memory, ..GpuLimits::NONE });
        match HemicubeRows::new(&gpu, &mesh, 128) {
            Ok(mut rows) => {
                assert!(rows.rows(&mesh, &patches, 1.0).unwrap() == all, "{memory}");
                fits.push(memory);
                // All of it is given back: as much fits again.
                drop(rows);
                assert!(HemicubeRows::new(&gpu, &mesh, 128).is_ok());
            }
            Err(e) => {
                assert_eq!((e.kind(), fits.len()), (ErrorKind::Memory, 0));
                let text = e.to_string();
                assert!(text.contains("bytes for") && text.contains(&memory.to_string()), "{text}");
                // The device is as good as before: what needs little gets it.
                let gpu = Gpu::clone(&gpu);
                let small = Mesh::new(mesh.scene().clone(), f64::INFINITY);
                assert!(memory < one || HemicubeRows::new(&gpu, &small.unwrap(), 16).is_ok());
            }
        }
    }
    assert!(fits[0] <= 4 * one && fits[0] > one / 16, "{} of {one}", fits[0]);
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn little_memory_gathers_the_same_in_smaller_batches() {
    let gpu = gpu();
    let mesh = cornell_box(100.0);
    let light = GatheredMesh::from_elements(&mesh, &vec![Rgb::ONE; mesh.element_count()]);
    let light = light.unwrap();
    let place = |e: usize| {
        let (node, normal) = (mesh.element(e), mesh.normal(mesh.element(e)));
        GatherPoint { position: mesh.centroid(node) + 0.01 * normal, normal, near: 1e-3 }
    };
    let places: Vec<GatherPoint> = (0..40).map(|e| place(7 * e)).collect();
    let gather =
        |gpu: &Gpu| TracedGather::new(gpu, &mesh, 64)?.gather(&light.radiosity_field(), &places);
    let all = gather(&gpu).unwrap();
    // The light, in whole lines of 2 048 texels, takes most of it; a batch of 64 points some 50 KB,
    // one of one point a sixty-fourth of that.
    let one: u64 = 1 << 17;
    let mut fits = vec![];
    // In steps of an eighth: somewhere there is room for all but the light that comes last.
    for memory in (0..24).map(|k| (one as f64 * 1.5f64.powi(k) / 2.0) as u64) {
        match gather(&within(GpuLimits { memory, ..GpuLimits::NONE })) {
            Ok(found) => {
                assert!(found == all, "{memory}");
                fits.push(memory);
            }
            Err(e) => assert_eq!((e.kind(), fits.len()), (ErrorKind::Memory, 0), "{memory}: {e}"),
        }
    }
    assert!(fits[0] > one / 2 && fits[0] < 8 * one, "{} of {one}", fits[0]);
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn limits_of_small_device_are_reported() {
    let mesh = furnace();
    let small = within(GpuLimits { texture: 256, ..GpuLimits::NONE });
    // An item buffer is three times as high as wide: 3 · 84 = 252.
    let e = HemicubeRows::new(&small, &mesh, 128).unwrap_err();
    let text = e.to_string();
    assert!(e.kind() == ErrorKind::Setting && e.place() == "hemicube resolution 128", "{text}");
    assert!(text.contains("this device allows resolutions up to 84"), "{text}");
    HemicubeRows::new(&small, &mesh, 84).unwrap();
    for e in [
        TracedGather::new(&small, &mesh, 128).unwrap_err(),
        TracedRows::new(&small, &mesh, 128).unwrap_err(),
    ] {
        let text = e.to_string();
        assert!(e.kind() == ErrorKind::Setting && text.contains("take 2048"), "{text}");
    }
    // Rows of 4 bytes an element in buffers of 64 KiB: some 16 000 elements.
    let few = within(GpuLimits { buffer: 64 << 10, ..GpuLimits::NONE });
    let large = cornell_box(20.0);
    let e = HemicubeRows::new(&few, &large, 16).unwrap_err();
    assert!(e.kind() == ErrorKind::Memory && e.place() == "mesh", "{e}");
    assert!(e.to_string().contains(&format!("{}", (64 << 10) / 4)), "{e}");
    // A bake says so, and casts rays on the CPU.
    let mut settings = BakeSettings::elements_only(large.scene());
    settings.solve.element_size = 20.0;
    settings.solve.hemicube_resolution = MANY_PIXELS;
    settings.solve.solver.unshot = 0.5;
    let bake = |device: Backend| settings.bake(large.scene().clone(), &device, keep_going).unwrap();
    let (baked, on_the_cpu) = (bake(Backend::Gpu(few)), bake(Backend::Cpu));
    assert_eq!(baked.device_failure.expect("too small").kind(), ErrorKind::Memory);
    assert!(baked.light.surface.radiosity == on_the_cpu.light.surface.radiosity);
    // One layer is one hemicube at a time, and the same rows.
    let patches: Vec<NodeId> = (0..20).map(|e| mesh.element(e)).collect();
    let [one, many] = [1, 16].map(|layers| {
        let gpu = within(GpuLimits { layers, ..GpuLimits::NONE });
        HemicubeRows::new(&gpu, &mesh, 32).unwrap().rows(&mesh, &patches, 1.0).unwrap()
    });
    assert!(one == many);
}
