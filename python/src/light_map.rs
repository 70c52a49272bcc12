//! Light maps.

use std::path::PathBuf;

use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods as _};
use pyo3::prelude::*;
use radiosity::io::{
    MapBinding, ToneCurve, rgbm_range, write_light_map_exr, write_light_map_glb,
    write_light_map_ktx2, write_light_map_rgbm, write_mapped_gltf,
};
use radiosity::light_map::{Atlas, Coordinates, LayoutSettings, LightMap, Resolution};
use radiosity::{Error, ErrorKind};

use crate::arrays::image;
use crate::bake::PyBake;
use crate::scene::PyScene;
use crate::work::{run_at_once, run_whole};

/// Texels of irradiance.
#[pyclass(frozen, name = "LightMap", module = "radiosity._radiosity")]
#[derive(Debug)]
pub struct PyLightMap {
    map: LightMap,
    between: Option<(f64, f64)>,
    of_light: f64,
}

/// The scene to bake for a map of it: a triangle for each side that reflects, with the edge of a
/// texel and the size of the map.
#[pyclass(frozen, name = "Atlas", module = "radiosity._radiosity")]
#[derive(Debug)]
pub struct PyAtlas(Atlas);

/// Lays out the surfaces of a scene: by pixels along a side, by the edge of a texel, or in the
/// fewest texels that they have room in.
#[pyfunction]
pub fn atlas(
    py: Python<'_>,
    scene: &PyScene,
    pixels: Option<u32>,
    texel: Option<f64>,
    coordinates: &str,
    padding: u32,
) -> PyResult<PyAtlas> {
    let resolution = pixels.map(Resolution::Pixels).or(texel.map(Resolution::TexelSize));
    let mut settings = LayoutSettings::new(resolution.unwrap_or(Resolution::Pixels(1)));
    settings.padding = padding;
    settings.coordinates = match coordinates {
        "file" => Coordinates::Given,
        "new" => Coordinates::Unwrapped,
        _ => Coordinates::Auto,
    };
    let scene = scene.0.clone();
    let lay_out = || match resolution {
        Some(_) => Atlas::with_settings(scene, &settings),
        None => Atlas::in_fewest_texels(scene, &settings),
    };
    run_at_once(py, lay_out).map(PyAtlas)
}

#[pymethods]
impl PyAtlas {
    #[getter]
    fn scene(&self) -> PyScene {
        PyScene(self.0.scene().clone())
    }
}

/// The map of a bake of the scene of an atlas, corrected by paths until light at texels is off by
/// less than `error`.
#[pyfunction]
pub fn light_map(
    py: Python<'_>,
    atlas: &PyAtlas,
    bake: &PyBake,
    error: f64,
    threads: usize,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<PyLightMap> {
    let (baked, backend) = (bake.baked(), bake.backend());
    run_whole(py, threads, progress, |reporter| {
        let count = |stage| move |done, of| reporter.count(stage, done, of);
        let map = LightMap::of_bake(atlas.0.clone(), baked, backend, count("texels"))?;
        let Some(mut map) = map else { return Ok(None) };
        let between = map.shown_error(baked, backend, count("points between texels"))?;
        let Some(of_light) = map.correct(baked, error, count("paths"))? else { return Ok(None) };
        let between = between.map(|e| (e.value, e.standard_error));
        Ok(Some(PyLightMap { map, between, of_light }))
    })
}

#[pymethods]
impl PyLightMap {
    #[getter]
    fn irradiance<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let map = &slf.get().map;
        image(slf.as_any(), &map.irradiance, [map.atlas.width(), map.atlas.height()])
    }

    #[getter]
    fn gathered<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<bool>>> {
        let shape = [self.map.atlas.height(), self.map.atlas.width()].map(|side| side as usize);
        PyArray1::from_slice(py, &self.map.gathered).reshape(shape)
    }

    #[getter]
    fn standard_error<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let shape = [self.map.atlas.height(), self.map.atlas.width()].map(|side| side as usize);
        PyArray1::from_slice(py, &self.map.standard_error).reshape(shape)
    }

    /// Coordinates of the corners of faces in the map, (m, 3, 2); v is 0 in the first row.
    #[getter]
    fn coordinates<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let atlas = &self.map.atlas;
        let count = atlas.scene().triangles().len();
        let all = (0..count).flat_map(|t| atlas.coordinates(t)).flat_map(|p| [p.x, p.y]);
        PyArray1::from_vec(py, all.collect()).reshape([count, 3, 2])
    }

    #[getter]
    fn scene(&self) -> PyScene {
        PyScene(self.map.atlas.scene().clone())
    }

    /// What is lost of the light between texels, and its standard error.
    #[getter]
    fn error_between_texels(&self) -> Option<(f64, f64)> {
        self.between
    }

    /// Error of the light at texels.
    #[getter]
    fn error_of_light(&self) -> f64 {
        self.of_light
    }

    /// Writes a file in the format of its ending; a glTF as the file `source` with a map of
    /// `binding`.
    fn save(
        &self,
        py: Python<'_>,
        path: PathBuf,
        source: Option<PathBuf>,
        binding: &str,
        map_file: Option<String>,
    ) -> PyResult<()> {
        run_at_once(py, || self.write(&path, source, binding, map_file))
    }
}

impl PyLightMap {
    fn write(
        &self,
        path: &PathBuf,
        source: Option<PathBuf>,
        binding: &str,
        map_file: Option<String>,
    ) -> Result<(), Error> {
        let map = &self.map;
        let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_lowercase();
        let tone = || ToneCurve::fit(&map.radiosity());
        match (&*ending, source) {
            ("exr", None) => write_light_map_exr(path, map),
            ("ktx2", None) => write_light_map_ktx2(path, map),
            ("png", None) => write_light_map_rgbm(path, map, rgbm_range(map)),
            ("glb", None) => write_light_map_glb(path, map, &tone()),
            ("glb" | "gltf", Some(source)) => {
                let files: Vec<String> = map_file.into_iter().collect();
                let binding = match binding {
                    "emissive" => MapBinding::Emissive,
                    "occlusion" => MapBinding::Occlusion,
                    _ => MapBinding::Extras,
                };
                write_mapped_gltf(path, &source, map, None, (binding, &files), &tone()).map(|_| ())
            }
            _ => {
                let (place, remedy) =
                    (path.display().to_string(), "end it in .exr, .ktx2, .png or .glb");
                Err(Error::new(ErrorKind::Setting, place, "a format that is not written", remedy))
            }
        }
    }
}
