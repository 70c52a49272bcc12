//! Bakes, and what is measured in their light.

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::Duration;

use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods as _, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use radiosity::backend::AdapterKind;
use radiosity::bake::{BakeProgress, Obstacle, Outcome};
use radiosity::camera::RadianceImage;
use radiosity::glam::DVec3;
use radiosity::grid::{GridPlane, GridSettings, MeasuredGrid, MeasuringGrid};
use radiosity::io::{GlbSettings, ToneCurve, write_lit_gltf};
use radiosity::kept_mesh::error_of_bake;
use radiosity::probe::{Probe, ProbeGrid, correct_probes, probes_at};
use radiosity::scene::Aabb;
use radiosity::verify::{Settings as VerifySettings, Verification, verify};
use radiosity::{
    Backend, BakeResult, BakeTarget, Camera, Error, ErrorKind, Rgb, Scene, VertexMesh, write_exr,
    write_glb, write_ply, write_png,
};

use crate::arrays::{check_columns, image, rows, vectors, view1, view2};
use crate::scene::PyScene;
use crate::work::{Done, Reporter, raise, run, run_at_once, run_whole};

/// A device: `cpu`, `auto` for graphics hardware where there is any, or a part of the name of an
/// adapter.
fn device(name: &str) -> Result<Backend, Error> {
    match name {
        "cpu" => Ok(Backend::Cpu),
        "auto" => Ok(Backend::gpu(None)
            .ok()
            .filter(|device| device.adapter().kind != AdapterKind::Cpu)
            .unwrap_or(Backend::Cpu)),
        name => Backend::gpu(Some(name)),
    }
}

/// Light at vertices.
#[pyclass(frozen, name = "Bake", module = "radiosity._radiosity")]
#[derive(Debug)]
pub struct PyBake {
    baked: BakeResult,
    /// Light at the vertices of the scene, if these are kept.
    kept: Option<VertexMesh>,
    backend: Backend,
    seconds: f64,
}

/// Passes the progress of a bake on.
fn report(reporter: &Reporter, progress: &BakeProgress) -> ControlFlow<()> {
    match progress {
        BakeProgress::Shooting(_) => reporter.report("shooting", None),
        BakeProgress::Gathering(p) => reporter.count("gathering", p.gathered, p.total),
        BakeProgress::Estimating { samples, of } => reporter.count("estimating", *samples, *of),
        BakeProgress::Estimated(estimate) => reporter.error(estimate.total),
        BakeProgress::DeviceFailed(_) => reporter.report("device failed: rays on the CPU", None),
        _ => reporter.report("baking", None),
    }
}

/// Bakes a scene to an error, within a time, or both: whichever comes first.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "one for each setting")]
pub fn bake(
    py: Python<'_>,
    scene: &PyScene,
    error: Option<f64>,
    time: Option<f64>,
    each_group: bool,
    keep_vertices: bool,
    device_name: &str,
    threads: usize,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<(PyBake, Option<PyErr>)> {
    let start = std::time::Instant::now();
    let seconds = |time: f64| {
        let found = format!("{time}: give seconds above 0");
        let time = Duration::try_from_secs_f64(time).ok().filter(|time| !time.is_zero());
        time.ok_or_else(|| PyValueError::new_err(found))
    };
    let of_bake = |error: f64| if keep_vertices { error_of_bake(error) } else { error };
    let target = match (error.map(of_bake), time) {
        (Some(error), None) if each_group => BakeTarget::ErrorEach(error),
        (Some(error), None) => BakeTarget::Error(error),
        (None, Some(time)) => BakeTarget::Time(seconds(time)?),
        (Some(error), Some(time)) => BakeTarget::Within { error, each_group, time: seconds(time)? },
        (None, None) => return Err(PyValueError::new_err("give error=, time= or both")),
    };
    let scene = scene.0.clone();
    let Done { result, raised } = run(py, threads, progress, |reporter| {
        let backend = device(device_name)?;
        let mut baked = target.bake(scene.clone(), &backend, |p| report(reporter, p))?;
        let backend = if baked.device_failure.is_some() { Backend::Cpu } else { backend };
        let mut kept = None;
        if keep_vertices {
            let to = error.unwrap_or(baked.estimate.total.clamp(1e-4, 0.9));
            let light = baked.on_kept_mesh(scene, to, &backend, |done, of| {
                reporter.count("vertices of the scene", done, of)
            })?;
            if let Some(light) = light {
                kept = Some(light.light.at_positions().0);
                baked = light;
            }
        }
        Ok((baked, kept, backend))
    })?;
    let (baked, kept, backend) = result;
    let seconds = start.elapsed().as_secs_f64();
    Ok((PyBake { baked, kept, backend, seconds }, raised))
}

#[pymethods]
impl PyBake {
    #[getter]
    fn positions<'py>(slf: &Bound<'py, Self>) -> Bound<'py, PyArray2<f64>> {
        view2(slf.as_any(), rows(&slf.get().surface().positions))
    }

    #[getter]
    fn normals<'py>(slf: &Bound<'py, Self>) -> Bound<'py, PyArray2<f64>> {
        view2(slf.as_any(), rows(&slf.get().surface().normals))
    }

    #[getter]
    fn faces<'py>(slf: &Bound<'py, Self>) -> Bound<'py, PyArray2<u32>> {
        view2(slf.as_any(), &slf.get().surface().faces)
    }

    #[getter]
    fn radiosity<'py>(slf: &Bound<'py, Self>) -> Bound<'py, PyArray2<f64>> {
        view2(slf.as_any(), rows(&slf.get().surface().radiosity))
    }

    #[getter]
    fn irradiance<'py>(slf: &Bound<'py, Self>) -> Bound<'py, PyArray2<f64>> {
        view2(slf.as_any(), rows(&slf.get().surface().irradiance))
    }

    #[getter]
    fn error<'py>(slf: &Bound<'py, Self>) -> Bound<'py, PyArray1<f64>> {
        view1(slf.as_any(), &slf.get().surface().error)
    }

    #[getter]
    fn face_groups<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u32>> {
        let mesh = &self.baked.light.mesh;
        let group = |&e: &u32| {
            let t = mesh.triangle(mesh.element(e as usize));
            mesh.scene().triangles()[t].group
        };
        PyArray1::from_iter(py, self.surface().elements.iter().map(group))
    }

    #[getter]
    fn scene(&self) -> PyScene {
        PyScene(self.baked.light.mesh.shared_scene())
    }

    /// What was measured of the bake.
    fn report<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let report = PyDict::new(py);
        let BakeResult { estimate, outcome, .. } = &self.baked;
        report.set_item("error", estimate.total)?;
        for (name, value) in [
            ("mesh", estimate.mesh),
            ("sampling", estimate.sampling),
            ("truncation", estimate.truncation),
            ("unshot", estimate.unshot),
            ("sources", estimate.sources),
            ("tail", estimate.tail),
        ] {
            report.set_item(format!("error_{name}"), value)?;
        }
        let groups = PyDict::new(py);
        for group in &self.baked.groups {
            let name = &self.baked.light.mesh.scene().groups()[group.group as usize];
            groups.set_item(name, group.estimate.total)?;
        }
        report.set_item("error_of_groups", groups)?;
        report.set_item("reached", matches!(outcome, Outcome::Reached | Outcome::Unasked))?;
        report.set_item("stopped", matches!(outcome, Outcome::Missed(Obstacle::Cancelled)))?;
        report.set_item("outcome", outcome.to_string())?;
        report.set_item("gathers", self.baked.light.gather_count)?;
        report.set_item("device", self.backend.adapter().name)?;
        let failure = self.baked.device_failure.as_ref();
        report.set_item("device_failure", failure.map(ToString::to_string))?;
        report.set_item("seconds", self.seconds)?;
        report.set_item("warnings", self.scene().warnings())?;
        Ok(report)
    }

    /// Writes a file in the format of its ending; a GLB as the file `source` with light, if given.
    #[pyo3(signature = (path, source=None))]
    fn save(&self, py: Python<'_>, path: PathBuf, source: Option<PathBuf>) -> PyResult<()> {
        run_at_once(py, || save(&self.baked, self.surface(), &path, source))
    }

    /// A picture: radiance (rows, columns, 3), W/(m2 sr). A camera is its eye, target, up axis and
    /// vertical field of view.
    #[expect(clippy::type_complexity, reason = "as in the docstring")]
    fn picture(
        &self,
        py: Python<'_>,
        camera: Option<([f64; 3], [f64; 3], [f64; 3], f64)>,
        size: [u32; 2],
        threads: usize,
    ) -> PyResult<PyImage> {
        let [width, height] = size;
        let image = run_whole(py, threads, None, |_| {
            let light = &self.baked.light;
            let camera = match camera {
                None => Camera::framing(light, f64::from(width) / f64::from(height)),
                Some((eye, target, up, vertical_fov)) => {
                    let [eye, target, up] = [eye, target, up].map(DVec3::from_array);
                    Camera { eye, target, up, vertical_fov }
                }
            };
            camera.image(&light.surface, width, height, 4).map(Some)
        })?;
        Ok(PyImage(image))
    }

    /// Measures grids in the light.
    #[expect(clippy::too_many_arguments, reason = "one for each setting")]
    fn grid(
        &self,
        py: Python<'_>,
        error: f64,
        plane: Option<[[f64; 3]; 3]>,
        group: Option<String>,
        height: f64,
        strip: f64,
        spacing: Option<f64>,
        metre: f64,
        threads: usize,
        progress: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Vec<PyGrid>> {
        let light = &self.baked.light;
        let scene = light.mesh.scene();
        let settings = GridSettings { metre, strip, spacing };
        let grids = || -> Result<Vec<MeasuringGrid>, Error> {
            Ok(match (plane, group) {
                (Some(plane), _) => {
                    let [origin, u, v] = plane.map(DVec3::from_array);
                    let plane = GridPlane { origin, edges: [u, v] };
                    vec![MeasuringGrid::on_plane("plane", plane, &settings)?]
                }
                (None, Some(group)) => {
                    let up = scene.up();
                    vec![MeasuringGrid::above_group(scene, &group, up, height, &settings)?]
                }
                (None, None) => MeasuringGrid::above_floors(scene, scene.up(), height, &settings)?,
            })
        };
        let measured = run_whole(py, threads, progress, |reporter| {
            let grids = grids()?;
            let mut gatherers = |noise| self.backend.gather_to_noise(light, noise);
            let points = |done, of| reporter.count("points", done, of);
            let measured = MeasuringGrid::measure_to(&grids, light, &mut gatherers, error, points)?;
            let Some(mut measured) = measured else { return Ok(None) };
            let mut reached = vec![];
            for grid in &mut measured {
                let paths = |done, of| reporter.count("paths", done, of);
                let Some(correction) = grid.correct(light, error, paths)? else {
                    return Ok(None);
                };
                reached.push(correction.is_reached);
            }
            Ok(Some((measured, reached)))
        })?;
        let grids = measured.0.into_iter().zip(measured.1);
        Ok(grids.map(|(measured, is_reached)| PyGrid::new(&measured, is_reached)).collect())
    }

    /// Probes in a box: positions (n, 3), harmonics (n, 9, 3), deviation (n,), inside (n,), and
    /// whether the error is reached.
    #[expect(clippy::type_complexity, reason = "arrays")]
    fn probes<'py>(
        &self,
        py: Python<'py>,
        error: f64,
        positions: PyReadonlyArray2<'py, f64>,
        size: f64,
        threads: usize,
        progress: Option<Bound<'py, PyAny>>,
    ) -> PyResult<(
        Bound<'py, PyArray3<f64>>,
        Bound<'py, PyArray1<f64>>,
        Bound<'py, PyArray1<bool>>,
        bool,
    )> {
        check_columns(&positions, 3)?;
        let (light, positions) = (&self.baked.light, vectors(&positions));
        let (probes, is_reached) = run_whole(py, threads, progress, |reporter| {
            let mut gatherer = self.backend.gather_to_noise(light, error)?;
            let count = |done, of| reporter.count("probes", done, of);
            let probes = probes_at(light, &positions, size, &mut *gatherer, count)?;
            let Some(mut probes) = probes else { return Ok(None) };
            let paths = |done, of| reporter.count("paths", done, of);
            let correction = correct_probes(light, &mut probes, size, error, paths)?;
            Ok(correction.map(|correction| (probes, correction.is_reached)))
        })?;
        let coefficients: Vec<f64> = probes
            .iter()
            .flat_map(|probe| probe.irradiance.coefficients)
            .flat_map(|c| c.to_array())
            .collect();
        let coefficients = PyArray1::from_vec(py, coefficients).reshape([probes.len(), 9, 3])?;
        let deviations = PyArray1::from_iter(py, probes.iter().map(|probe| probe.deviation));
        let inside = PyArray1::from_iter(py, probes.iter().map(Probe::is_inside));
        Ok((coefficients, deviations, inside, is_reached))
    }
}

impl PyBake {
    fn surface(&self) -> &VertexMesh {
        self.kept.as_ref().unwrap_or(&self.baked.light.surface)
    }

    pub fn baked(&self) -> &BakeResult {
        &self.baked
    }

    pub fn backend(&self) -> &Backend {
        &self.backend
    }
}

/// Middles of the cells of a box: positions (n, 3), counts and the size of a cell.
#[pyfunction]
pub fn probe_positions<'py>(
    py: Python<'py>,
    bounds: [[f64; 3]; 2],
    counts: Option<[usize; 3]>,
    spacing: f64,
) -> PyResult<(Bound<'py, PyArray2<f64>>, [usize; 3], f64)> {
    let [low, high] = bounds.map(DVec3::from_array);
    let bounds = Aabb { low, high };
    let grid = match counts {
        Some(counts) => ProbeGrid::with_counts(&bounds, counts),
        None => ProbeGrid::with_spacing(&bounds, spacing),
    };
    let grid = grid.map_err(raise)?;
    let positions: Vec<f64> = grid.positions().iter().flat_map(|p| p.to_array()).collect();
    let count = positions.len() / 3;
    Ok((PyArray1::from_vec(py, positions).reshape([count, 3])?, grid.counts, grid.size()))
}

fn save(
    baked: &BakeResult,
    surface: &VertexMesh,
    path: &PathBuf,
    source: Option<PathBuf>,
) -> Result<(), Error> {
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_lowercase();
    let tone = ToneCurve::fit(&surface.radiosity);
    let picture = || Camera::framing(&baked.light, 1.5).image(&baked.light.surface, 768, 512, 4);
    match (&*ending, source) {
        ("ply", None) => write_ply(path, surface),
        ("glb" | "gltf", Some(source)) => {
            write_lit_gltf(path, &source, &baked.light, None, &tone).map(|_| ())
        }
        ("glb", None) => {
            let mut settings = GlbSettings::from(&tone);
            settings.error = baked.estimate.total;
            write_glb(path, &baked.light, settings)
        }
        ("png", None) => write_png(path, &picture()?),
        ("exr", None) => write_exr(path, &picture()?),
        _ => {
            let (place, remedy) =
                (path.display().to_string(), "end it in .ply, .glb, .png or .exr");
            Err(Error::new(ErrorKind::Setting, place, "a format that is not written", remedy))
        }
    }
}

/// A picture of radiance.
#[pyclass(frozen, name = "Image", module = "radiosity._radiosity")]
#[derive(Debug)]
pub struct PyImage(RadianceImage);

#[pymethods]
impl PyImage {
    #[getter]
    fn pixels<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let RadianceImage { width, height, pixels, .. } = &slf.get().0;
        image(slf.as_any(), pixels, [*width, *height])
    }

    /// The same in colours of sRGB, (rows, columns, 3) of 8 bits.
    fn colours<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<u8>>> {
        let RadianceImage { width, height, pixels, .. } = &self.0;
        let tone = ToneCurve::fit_image(&self.0);
        let bytes: Vec<u8> = pixels.iter().flat_map(|&c| tone.display(c)).collect();
        let shape = [*height as usize, *width as usize, 3];
        PyArray1::from_vec(py, bytes).reshape(shape)
    }
}

/// Values on a grid.
#[pyclass(frozen, name = "Grid", module = "radiosity._radiosity")]
#[derive(Debug)]
pub struct PyGrid {
    name: String,
    shape: [u32; 2],
    points: Vec<DVec3>,
    irradiance: Vec<Rgb>,
    standard_error: Vec<Rgb>,
    mean_error: Rgb,
    is_reached: bool,
}

impl PyGrid {
    fn new(measured: &MeasuredGrid, is_reached: bool) -> PyGrid {
        let values = || measured.values.iter().map(|v| v.filter(|v| !v.is_buried()));
        let nothing = DVec3::NAN;
        PyGrid {
            name: measured.grid.name.clone(),
            shape: measured.grid.counts.map(|count| count as u32),
            points: measured.grid.points.iter().map(|p| p.unwrap_or(nothing)).collect(),
            irradiance: values().map(|v| v.map_or(nothing, |v| v.irradiance)).collect(),
            standard_error: values().map(|v| v.map_or(nothing, |v| v.standard_error)).collect(),
            mean_error: measured.mean_error,
            is_reached,
        }
    }
}

#[pymethods]
impl PyGrid {
    #[getter]
    fn name(&self) -> &str {
        &self.name
    }

    #[getter]
    fn points<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        image(slf.as_any(), &slf.get().points, slf.get().shape)
    }

    #[getter]
    fn irradiance<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        image(slf.as_any(), &slf.get().irradiance, slf.get().shape)
    }

    #[getter]
    fn standard_error<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        image(slf.as_any(), &slf.get().standard_error, slf.get().shape)
    }

    #[getter]
    fn mean_error(&self) -> [f64; 3] {
        self.mean_error.to_array()
    }

    #[getter]
    fn is_reached(&self) -> bool {
        self.is_reached
    }
}

/// Measures how far off a solution is: of a bake or of arrays, by paths.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "one for each setting")]
pub fn verify_solution<'py>(
    py: Python<'py>,
    scene: &PyScene,
    positions: PyReadonlyArray2<'py, f64>,
    faces: PyReadonlyArray2<'py, u32>,
    radiosity: PyReadonlyArray2<'py, f64>,
    precision: f64,
    time: Option<f64>,
    seed: u64,
    threads: usize,
    progress: Option<Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    for array in [&positions, &radiosity] {
        check_columns(array, 3)?;
    }
    check_columns(&faces, 3)?;
    let corners = faces.as_array();
    let faces: Vec<[u32; 3]> =
        corners.rows().into_iter().map(|row| [row[0], row[1], row[2]]).collect();
    let solution = VertexMesh {
        positions: vectors(&positions),
        radiosity: vectors(&radiosity),
        elements: (0..faces.len() as u32).collect(),
        faces,
        ..VertexMesh::default()
    };
    let mut settings = VerifySettings::default();
    (settings.precision, settings.seed) = (precision, seed);
    settings.time = time.and_then(|time| Duration::try_from_secs_f64(time).ok());
    let scene: &Scene = &scene.0;
    let Done { result, .. } = run(py, threads, progress, |reporter| {
        verify(scene, &solution, &settings, |p| {
            if let Some(error) = p.error {
                reporter.error(error.value)?;
            }
            reporter.count("points", p.done, p.of)
        })
    })?;
    verification(py, scene, &result)
}

fn verification<'py>(
    py: Python<'py>,
    scene: &Scene,
    found: &Verification,
) -> PyResult<Bound<'py, PyDict>> {
    let report = PyDict::new(py);
    report.set_item("error", found.error.map(|e| e.value))?;
    report.set_item("standard_error", found.error.map(|e| e.standard_error))?;
    report.set_item("error_with_tail", found.error_with_tail.map(|e| e.value))?;
    report.set_item("error_with_hidden", found.error_with_hidden.map(|e| e.value))?;
    report.set_item("hidden_share", found.hidden_share)?;
    let groups = PyDict::new(py);
    for group in &found.groups {
        let error = group.error.map(|e| (e.value, e.standard_error));
        groups.set_item(&scene.groups()[group.group], error)?;
    }
    report.set_item("groups", groups)?;
    report.set_item("points", found.points.len())?;
    report.set_item("paths", found.paths)?;
    report.set_item("missing", found.missing)?;
    report.set_item("stop", format!("{:?}", found.stop).to_lowercase())?;
    Ok(report)
}
