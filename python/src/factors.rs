//! View factors, and heat by them.

use std::path::PathBuf;

use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use radiosity::ViewFactors;
use radiosity::heat::{Boundary, HeatBalance, HeatSettings, Surface};
use radiosity::view_factor::{Factor, Missing};

use crate::arrays::{check_columns, numbers};
use crate::scene::PyScene;
use crate::work::{raise, run_at_once, run_whole};

/// A matrix of view factors.
#[pyclass(frozen, name = "Factors", module = "radiosity._radiosity")]
#[derive(Debug)]
pub struct PyFactors(ViewFactors);

/// View factors between the groups of a scene; `method` is auto, exact or sparse.
#[pyfunction]
pub fn view_factors(
    py: Python<'_>,
    scene: &PyScene,
    error: f64,
    two_sided: Vec<usize>,
    method: &str,
    threads: usize,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<PyFactors> {
    let scene = &scene.0;
    let matrix = run_whole(py, threads, progress, |reporter| {
        let count = |done, of| reporter.count("view factors", done, of);
        match method {
            "exact" => ViewFactors::exact(scene, error, &two_sided, count),
            "sparse" => ViewFactors::sparse(scene, error, &two_sided, count),
            _ => ViewFactors::new(scene, error, &two_sided, count),
        }
    })?;
    Ok(PyFactors(matrix))
}

#[pymethods]
impl PyFactors {
    /// Nonzeros as compressed rows: data, standard error, indices, and where rows begin.
    #[expect(clippy::type_complexity, reason = "arrays")]
    fn rows<'py>(
        &self,
        py: Python<'py>,
    ) -> (
        Bound<'py, PyArray1<f64>>,
        Bound<'py, PyArray1<f64>>,
        Bound<'py, PyArray1<i32>>,
        Bound<'py, PyArray1<i64>>,
    ) {
        let all = || self.0.factors.iter().flatten();
        let ends = self.0.factors.iter().scan(0, |end, row| {
            *end += row.len() as i64;
            Some(*end)
        });
        (
            PyArray1::from_vec(py, all().map(|f| f.value).collect()),
            PyArray1::from_vec(py, all().map(|f| f.error).collect()),
            PyArray1::from_vec(py, all().map(|f| f.to as i32).collect()),
            PyArray1::from_vec(py, std::iter::once(0).chain(ends).collect()),
        )
    }

    #[getter]
    fn names(&self) -> Vec<String> {
        self.0.names.clone()
    }

    /// Per row the front that it is the back of, -1 for fronts.
    #[getter]
    fn back_of<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        PyArray1::from_iter(py, self.0.back_of.iter().map(|front| front.map_or(-1, i64::from)))
    }

    #[getter]
    fn areas<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.0.areas)
    }

    #[getter]
    fn open<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(py, self.0.open.iter().map(|e| e.value))
    }

    #[getter]
    fn back<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(py, self.0.back.iter().map(|e| e.value))
    }

    /// Whether a pair that is absent is exactly zero.
    #[getter]
    fn is_exact(&self) -> bool {
        self.0.absent == Missing::Zero
    }

    /// Deviations from closure, reciprocity and bounds: (root mean square, largest).
    fn checks<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let checks = self.0.checks();
        let report = PyDict::new(py);
        for (name, stats) in [
            ("closure", checks.closure),
            ("reciprocity", checks.reciprocity),
            ("bounds", checks.bounds),
            ("row_sums", checks.row_sums),
        ] {
            report.set_item(name, (stats.rms, stats.max))?;
        }
        Ok(report)
    }

    /// The same with closure and reciprocity enforced, and the root mean square of the change.
    fn enforced(&self, py: Python<'_>) -> PyResult<(PyFactors, f64)> {
        let (enforced, report) = run_at_once(py, || Ok(self.0.enforced()))?;
        Ok((PyFactors(enforced), report.rms_change))
    }

    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        use radiosity::io::{view_factors, write_npz};
        let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
        py.detach(|| match ending {
            "npz" => write_npz(&path, &self.0).map_err(raise),
            "mtx" => view_factors::write_matrix_market(&path, &self.0).map_err(raise),
            "csv" => view_factors::write_csv_list(&path, &self.0).map_err(raise),
            _ => {
                let found = format!("{}: end it in .npz, .mtx or .csv", path.display());
                Err(PyValueError::new_err(found))
            }
        })
    }
}

/// A matrix of a file of [`PyFactors::save`].
#[pyfunction]
pub fn load_factors(py: Python<'_>, path: PathBuf) -> PyResult<PyFactors> {
    py.detach(|| radiosity::io::read_npz(&path)).map(PyFactors).map_err(raise)
}

/// A matrix of the caller's own: compressed rows, areas.
#[pyfunction]
pub fn factors_of_rows(
    data: PyReadonlyArray1<'_, f64>,
    error: PyReadonlyArray1<'_, f64>,
    indices: PyReadonlyArray1<'_, i64>,
    starts: PyReadonlyArray1<'_, i64>,
    areas: PyReadonlyArray1<'_, f64>,
    names: Vec<String>,
) -> PyFactors {
    let (data, error, indices) = (numbers(&data), numbers(&error), numbers(&indices));
    let factors: Vec<Vec<Factor>> = numbers(&starts)
        .windows(2)
        .map(|row| {
            let entries = row[0] as usize..row[1] as usize;
            let factor = |k| Factor { to: indices[k] as u32, value: data[k], error: error[k] };
            entries.map(factor).collect()
        })
        .collect();
    let open = factors.iter().map(|row| {
        let value = 1.0 - row.iter().map(|f| f.value).sum::<f64>();
        radiosity::view_factor::Estimate { value, error: 0.0 }
    });
    let (open, areas) = (open.collect(), numbers(&areas));
    let back = vec![Default::default(); areas.len()];
    let back_of = vec![None; areas.len()];
    PyFactors(ViewFactors { names, back_of, areas, factors, open, back, absent: Missing::Zero })
}

/// Heat exchange: temperature or net flux per row (the other NaN), emissivity (rows, bands).
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "one for each setting")]
pub fn heat<'py>(
    py: Python<'py>,
    factors: &PyFactors,
    temperature: PyReadonlyArray1<'py, f64>,
    net_flux: PyReadonlyArray1<'py, f64>,
    emissivity: PyReadonlyArray2<'py, f64>,
    surroundings: f64,
    band_edges: Vec<f64>,
    threads: usize,
) -> PyResult<Bound<'py, PyDict>> {
    check_columns(&emissivity, band_edges.len() + 1)?;
    let given = numbers(&temperature).into_iter().zip(numbers(&net_flux));
    let surfaces: Vec<Surface> = given
        .zip(emissivity.as_array().rows())
        .map(|((temperature, flux), emissivity)| Surface {
            boundary: match temperature.is_nan() {
                true => Boundary::NetFlux(flux),
                false => Boundary::Temperature(temperature),
            },
            emissivity: emissivity.to_vec(),
        })
        .collect();
    let settings = HeatSettings { band_edges, surroundings };
    let balance = run_whole(py, threads, None, |reporter| {
        HeatBalance::of(&factors.0, &surfaces, &settings, |_| reporter.report("heat", None))
    })?;
    let report = PyDict::new(py);
    let groups = || balance.groups.iter();
    let array = |values: Vec<f64>| PyArray1::from_vec(py, values);
    let temperatures = groups().map(|g| g.temperature.unwrap_or(f64::NAN)).collect();
    report.set_item("temperature", array(temperatures))?;
    report.set_item("net_flux", array(groups().map(|g| g.net_flux.value).collect()))?;
    report.set_item("standard_error", array(groups().map(|g| g.net_flux.error).collect()))?;
    report.set_item("radiosity", array(groups().map(|g| g.radiosity).collect()))?;
    report.set_item("irradiance", array(groups().map(|g| g.irradiance).collect()))?;
    report.set_item("supplied", balance.supplied)?;
    report.set_item("lost_to_surroundings", balance.lost_to_surroundings)?;
    report.set_item("lost_to_backs", balance.lost_to_backs)?;
    report.set_item("imbalance", balance.imbalance)?;
    report.set_item("residual", balance.residual)?;
    Ok(report)
}
