//! Scenes, and the light from outside.

use std::path::PathBuf;
use std::sync::Arc;

use numpy::{PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use radiosity::glam::DVec3;
use radiosity::io::{Input, PhotometrySettings, SpecularSurfaces, read_radiance};
use radiosity::scene::{Sides, SkyDistribution, SolarIrradiance, Sun};
use radiosity::{Error, ErrorKind, Material, Rgb, Scene, SceneSettings, Sky, Triangle};
use solar_positioning::time::JulianDate;
use solar_positioning::{Location, SolarPositions, delta_t};

use crate::arrays::{check_columns, numbers, rows, vectors, view2};
use crate::work::{raise, run_at_once};

/// A scene; it does not change.
#[pyclass(frozen, name = "Scene", module = "radiosity._radiosity")]
#[derive(Debug)]
pub struct PyScene(pub Arc<Scene>);

#[pymethods]
impl PyScene {
    /// Of arrays that were checked: positions (n, 3), faces (m, 3), per face the index of its group
    /// and its material, names of groups, and per material its name and (reflectance, exitance,
    /// transmittance) x RGB.
    #[staticmethod]
    #[expect(clippy::too_many_arguments, reason = "one for each array")]
    fn from_arrays(
        positions: PyReadonlyArray2<'_, f64>,
        faces: PyReadonlyArray2<'_, u32>,
        groups: PyReadonlyArray1<'_, u32>,
        materials: PyReadonlyArray1<'_, u32>,
        group_names: Vec<String>,
        material_names: Vec<String>,
        properties: PyReadonlyArray2<'_, f64>,
        both_sides: Option<bool>,
        up: Option<[f64; 3]>,
    ) -> PyResult<PyScene> {
        check_columns(&positions, 3)?;
        check_columns(&faces, 3)?;
        check_columns(&properties, 9)?;
        let sides = match both_sides {
            None => Sides::Auto,
            Some(true) => Sides::Both,
            Some(false) => Sides::Front,
        };
        let (groups, materials) = (numbers(&groups), numbers(&materials));
        let corners = faces.as_array();
        let triangles = corners.rows().into_iter().zip(groups).zip(materials);
        let triangles = triangles.map(|((row, group), material)| Triangle {
            corners: [row[0], row[1], row[2]],
            group,
            material,
            smoothing: None,
        });
        let properties = properties.as_array();
        let materials = material_names.into_iter().zip(properties.rows()).map(|(name, row)| {
            let rgb = |k: usize| Rgb::new(row[k], row[k + 1], row[k + 2]);
            let plain = Material::grey(name, 0.0);
            let [reflectance, exitance, transmittance] = [0, 3, 6].map(rgb);
            Material { reflectance, exitance, transmittance, sides, ..plain }
        });
        let (triangles, materials) = (triangles.collect(), materials.collect());
        let scene = Scene::new(vectors(&positions), triangles, group_names, materials);
        let mut scene = scene.map_err(raise)?;
        if let Some(up) = up {
            scene = scene.with_up(DVec3::from_array(up));
        }
        Ok(PyScene(Arc::new(scene)))
    }

    /// Of a file, or of bytes under its name with the files that it names.
    #[staticmethod]
    #[expect(clippy::too_many_arguments, reason = "one for each setting")]
    #[expect(clippy::type_complexity, reason = "names and bytes")]
    fn load(
        py: Python<'_>,
        path: PathBuf,
        content: Option<(Vec<u8>, Vec<(String, Vec<u8>)>)>,
        emit: Vec<(String, [f64; 3])>,
        transmit: Vec<(String, [f64; 3])>,
        facets: bool,
        strict: bool,
        texture_coordinates: bool,
        ignore_glass: bool,
        has_sky: bool,
    ) -> PyResult<PyScene> {
        let mut settings = SceneSettings::default();
        let colours = |of: Vec<(String, [f64; 3])>| {
            of.into_iter().map(|(name, colour)| (name, Rgb::from_array(colour))).collect()
        };
        (settings.emit, settings.transmit) = (colours(emit), colours(transmit));
        (settings.facets, settings.strict) = (facets, strict);
        settings.texture_coordinates = texture_coordinates;
        if ignore_glass {
            settings.specular = SpecularSurfaces::Ignore;
        }
        // Another takes its place: this one keeps the default from being chosen.
        settings.sky = has_sky.then(|| Rgb::ONE.into());
        let scene = run_at_once(py, || match &content {
            None => settings.load(&path),
            Some((content, files)) => {
                let files: Vec<(&str, &[u8])> =
                    files.iter().map(|(name, bytes)| (&**name, &**bytes)).collect();
                settings.load(Input::bytes(&path, content).with_files(&files))
            }
        })?;
        Ok(PyScene(Arc::new(scene)))
    }

    /// The same scene under another sky.
    fn with_sky(&self, sky: &PySky) -> PyResult<PyScene> {
        let scene = Scene::clone(&self.0).with_sky(sky.0.clone()).map_err(raise)?;
        Ok(PyScene(Arc::new(scene)))
    }

    /// The same scene with luminaires: file of photometry, position, aim, scale; the unit in
    /// metres.
    fn with_luminaires(
        &self,
        luminaires: Vec<(PathBuf, [f64; 3], [f64; 3], f64)>,
        unit: f64,
    ) -> PyResult<PyScene> {
        let mut all = vec![];
        for (path, position, aim, scale) in luminaires {
            let lamp = PhotometrySettings::default().read(&path).map_err(raise)?;
            let mut lamp = lamp
                .luminaire(DVec3::from_array(position), DVec3::from_array(aim))
                .in_unit_of(unit);
            lamp.scale *= scale;
            all.push(lamp);
        }
        let scene = Scene::clone(&self.0).with_luminaires(all).map_err(raise)?;
        Ok(PyScene(Arc::new(scene)))
    }

    #[getter]
    fn positions<'py>(slf: &Bound<'py, Self>) -> Bound<'py, PyArray2<f64>> {
        view2(slf.as_any(), rows(slf.get().0.positions()))
    }

    #[getter]
    fn faces<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<u32>> {
        let corners: Vec<u32> = self.0.triangles().iter().flat_map(|t| t.corners).collect();
        let rows = corners.len() / 3;
        use numpy::PyArrayMethods as _;
        let reshaped = PyArray1::from_vec(py, corners).reshape([rows, 3]);
        reshaped.expect("as many numbers as before")
    }

    #[getter]
    fn face_groups<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u32>> {
        PyArray1::from_iter(py, self.0.triangles().iter().map(|t| t.group))
    }

    #[getter]
    fn groups(&self) -> Vec<String> {
        self.0.groups().to_vec()
    }

    #[getter]
    fn materials(&self) -> Vec<String> {
        self.0.materials().iter().map(|m| m.name.clone()).collect()
    }

    #[getter]
    pub fn warnings(&self) -> Vec<String> {
        self.0.warnings().iter().map(ToString::to_string).collect()
    }

    #[getter]
    fn bounds(&self) -> [[f64; 3]; 2] {
        let bounds = self.0.bounds();
        [bounds.low.to_array(), bounds.high.to_array()]
    }

    #[getter]
    fn up(&self) -> [f64; 3] {
        self.0.up().to_array()
    }
}

/// The light from outside.
#[pyclass(frozen, name = "Sky", module = "radiosity._radiosity")]
#[derive(Debug)]
pub struct PySky(Sky);

fn no_sky(what: &str) -> PyErr {
    PyValueError::new_err(format!("{what} of a sky that does not exist"))
}

#[pymethods]
impl PySky {
    #[staticmethod]
    fn uniform(radiance: [f64; 3]) -> PySky {
        PySky(Sky::uniform(Rgb::from_array(radiance)))
    }

    #[staticmethod]
    fn cie(number: u32, zenith: [f64; 3], up: [f64; 3], sun: [f64; 3]) -> PyResult<PySky> {
        // 16 is not numbered in the crate: it is no member of the general family.
        let distribution = match number {
            16 => Some(SkyDistribution::OVERCAST),
            number => SkyDistribution::cie(number),
        };
        let distribution = distribution.ok_or_else(|| no_sky("number"))?;
        let [zenith, up, sun] = [zenith, up, sun].map(DVec3::from_array);
        Ok(PySky(Sky::new(distribution, zenith, up, sun).map_err(raise)?))
    }

    /// Perez' all-weather sky and its sun, by direct normal and diffuse horizontal irradiance; with
    /// a dew point in lumens, and by the day of the year, 0 for the mean.
    #[staticmethod]
    fn perez(
        direct_normal: f64,
        diffuse_horizontal: f64,
        up: [f64; 3],
        sun: [f64; 3],
        dew_point: Option<f64>,
        day: u32,
    ) -> PyResult<PySky> {
        let [up, sun] = [up, sun].map(DVec3::from_array);
        let (up, sun) = (up.normalize_or_zero(), sun.normalize_or_zero());
        let light = SolarIrradiance {
            direct_normal,
            diffuse_horizontal,
            sun_zenith: libm::acos(up.dot(sun).clamp(-1.0, 1.0)),
            extraterrestrial: match day {
                0 => SolarIrradiance::SOLAR_CONSTANT,
                day => SolarIrradiance::extraterrestrial_on(day),
            },
        };
        let efficacy = dew_point.map(|dew_point| light.efficacy(dew_point));
        let [direct, diffuse] = efficacy.map_or([1.0; 2], |e| [e.direct, e.diffuse]);
        let spread = |distribution| Sky::new(distribution, Rgb::ONE, up, sun);
        let diffuse = diffuse_horizontal * diffuse;
        let sky = match light.distribution() {
            None => Sky::default(),
            Some(distribution) => {
                let relative = spread(distribution).map_err(raise)?.irradiance(up).x;
                // One whose zenith is black has no radiance relative to it; then it is even above
                // the horizon, as CIE's number 5, in the program too.
                let (distribution, zenith) = match SkyDistribution::cie(5) {
                    Some(even) if relative <= 0.0 => (even, diffuse / std::f64::consts::PI),
                    _ => (distribution, diffuse / relative),
                };
                Sky::new(distribution, Rgb::splat(zenith), up, sun).map_err(raise)?
            }
        };
        let irradiance = Rgb::splat(direct_normal * direct);
        Ok(PySky(sky.with_sun(Sun { direction: sun, irradiance }).map_err(raise)?))
    }

    #[staticmethod]
    fn picture(pixels: PyReadonlyArray2<'_, f64>, width: u32, up: [f64; 3]) -> PyResult<PySky> {
        check_columns(&pixels, 3)?;
        let sky = Sky::picture(width, &vectors(&pixels), DVec3::from_array(up));
        Ok(PySky(sky.map_err(raise)?))
    }

    #[staticmethod]
    fn load(path: PathBuf, up: [f64; 3]) -> PyResult<PySky> {
        let (width, pixels) = read_radiance(&path).map_err(raise)?;
        Ok(PySky(Sky::picture(width, &pixels, DVec3::from_array(up)).map_err(raise)?))
    }

    fn with_sun(&self, direction: [f64; 3], irradiance: [f64; 3]) -> PyResult<PySky> {
        let (direction, irradiance) = (DVec3::from_array(direction), Rgb::from_array(irradiance));
        let sky = self.0.clone().with_sun(Sun { direction, irradiance });
        Ok(PySky(sky.map_err(raise)?))
    }

    /// Irradiance of a surface with this normal.
    fn irradiance(&self, normal: [f64; 3]) -> [f64; 3] {
        self.0.irradiance(DVec3::from_array(normal).normalize_or_zero()).to_array()
    }
}

/// Azimuth, from north over east, and elevation of the sun at a time (UTC) and place, degrees (Reda
/// and Andreas 2003).
#[pyfunction]
pub fn sun_angles(
    date: (i32, u32, u32),
    time: (u32, u32, f64),
    latitude: f64,
    longitude: f64,
) -> PyResult<[f64; 2]> {
    let ((year, month, day), (hour, minute, second)) = (date, time);
    let angles = || -> Result<[f64; 2], solar_positioning::Error> {
        let delta = delta_t::estimate_from_date(year, month)?;
        let time = JulianDate::from_utc(year, month, day, hour, minute, second, delta)?;
        let location = Location { latitude, longitude };
        let sun = SolarPositions::new().at_from_julian(time, location, 0.0, None)?;
        Ok([sun.azimuth(), 90.0 - sun.zenith_angle()])
    };
    angles().map_err(|e| {
        let (place, remedy) = ("sun's position", "give a time and a place on the earth");
        raise(Error::new(ErrorKind::Setting, place, e.to_string(), remedy))
    })
}
