//! The camera of a picture: given by numbers, or by its name in a glTF file.

use std::path::Path;

use clap::Args;
use radiosity::glam::DVec3;
use radiosity::io::read_cameras;
use radiosity::{Camera, Error, ErrorKind, GatheredMesh};

use crate::args::{self, Parsed, give};
use crate::{progress, standard};

#[derive(Args)]
pub struct CameraOption {
    /// Camera of the picture: eye, target, vertical field of view in degrees, and the direction up
    /// [0,1,0]; or the name of one in a glTF file [default: its first, or chosen, and in the
    /// report]
    #[arg(long, value_name = "NUMBERS", value_parser = given)]
    camera: Option<Given>,
    /// The camera, where it is known before the light is.
    #[arg(skip)]
    known: Option<Camera>,
}

/// A camera as the option gives it.
#[derive(Clone)]
enum Given {
    Numbers(Camera),
    Name(String),
}

const NUMBERS: &str = "7 numbers with commas between them, eye, target and degrees, or 10: the \
                       direction up behind them";

impl CameraOption {
    /// Finds the camera in the file `scene`, and checks whether it can take a picture of `size`
    /// pixels, each of `samples` × `samples` rays.
    ///
    /// # Errors
    /// Those of [`read_cameras`] and [`Camera::check`]; [`ErrorKind::Setting`] for neither numbers
    /// nor the name of a camera.
    pub fn find(&mut self, scene: &Path, size: [u32; 2], samples: u32) -> Result<(), Error> {
        self.known = match &self.camera {
            Some(Given::Numbers(camera)) => Some(*camera),
            Some(Given::Name(name)) => self.of_file(scene, Some(name))?,
            None => self.of_file(scene, None)?,
        };
        if self.camera.is_none()
            && let Some(Err(e)) = self.known.map(|camera| camera.check(1, 1, 1))
        {
            eprintln!("warning: the first camera of the file is passed over: {e}");
            self.known = None;
        }
        // The one that will be chosen is good; sizes are checked with any.
        let (eye, target, up) = (DVec3::ZERO, DVec3::Z, DVec3::Y);
        let any = Camera { eye, target, up, vertical_fov: 90.0 };
        self.known.unwrap_or(any).check(size[0], size[1], samples)
    }

    /// The camera of the file with this name, or its first one.
    fn of_file(&self, scene: &Path, wanted: Option<&str>) -> Result<Option<Camera>, Error> {
        let cameras = standard::input(scene).and_then(read_cameras).or_else(|e| match wanted {
            Some(_) => Err(e),
            // It is said when the scene is read.
            None => Ok(vec![]),
        })?;
        let Some(wanted) = wanted else {
            return Ok(cameras.first().map(|(_, camera)| *camera));
        };
        if let Some((_, camera)) = cameras.iter().find(|(name, _)| name == wanted) {
            return Ok(Some(*camera));
        }
        let names: Vec<&str> = cameras.iter().map(|(name, _)| name.as_str()).collect();
        let remedy = match names.is_empty() {
            true => format!("write {NUMBERS}"),
            false => format!("write {NUMBERS}; or one of the file's: {}", names.join(", ")),
        };
        let place = format!("--camera {wanted}");
        let found = "neither numbers nor a perspective camera of the file";
        Err(Error::new(ErrorKind::Setting, place, found, remedy))
    }

    /// The camera for a picture of `light` with so many pixels.
    pub fn of(&self, light: &GatheredMesh, [width, height]: [u32; 2]) -> Camera {
        self.known.unwrap_or_else(|| {
            progress::of_stage("choosing a view", || {
                Camera::framing(light, f64::from(width) / f64::from(height))
            })
        })
    }
}

/// Eye, target, degrees and, if there are three more numbers, the direction up; else a name.
fn given(text: &str) -> Parsed<Given> {
    let Ok(mut numbers) = args::list(NUMBERS)(text) else { return Ok(Given::Name(text.into())) };
    if numbers.len() == 7 {
        numbers.extend([0.0, 1.0, 0.0]);
    }
    if numbers.len() != 10 {
        return Err(give(NUMBERS));
    }
    let point = |k: usize| DVec3::from_slice(&numbers[k..k + 3]);
    let (eye, target, up) = (point(0), point(3), point(7));
    Ok(Given::Numbers(Camera { eye, target, up, vertical_fov: numbers[6] }))
}

/// `camera` as the value of `--camera`.
pub fn camera_value(camera: &Camera) -> String {
    let Camera { eye, target, up, vertical_fov } = camera;
    let mut numbers = [eye.to_array(), target.to_array()].concat();
    numbers.push(*vertical_fov);
    if up.to_array() != [0.0, 1.0, 0.0] {
        numbers.extend(up.to_array());
    }
    numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(",")
}
