//! How colours, axes and lengths of files for viewers are made.

use clap::Args;
use radiosity::camera::RadianceImage;
use radiosity::io::{GlbSettings, ToneCurve};
use radiosity::{Error, ErrorKind, GatheredMesh};

use crate::args::value;

#[derive(Args)]
pub struct ViewerOptions {
    /// Factor of radiance for the colours of png, glb and ply [default: chosen, and in the report]
    #[arg(long, value_name = "X", value_parser = value::<f64>("a number"))]
    exposure: Option<f64>,
}

impl ViewerOptions {
    /// # Errors
    /// [`ErrorKind::Setting`] for an exposure that is no factor.
    pub fn check(&self) -> Result<(), Error> {
        if let Some(exposure) = self.exposure
            && !(exposure > 0.0 && exposure.is_finite())
        {
            let place = format!("exposure {exposure}");
            let remedy = "give a factor above 0, such as the one that a report names";
            return Err(Error::new(ErrorKind::Setting, place, "out of range", remedy));
        }
        Ok(())
    }

    /// The curve of radiance for a picture: with the exposure that was given, else fitted to it.
    pub fn of_picture(&self, image: &RadianceImage) -> ToneCurve {
        self.given().unwrap_or_else(|| ToneCurve::fit_image(image))
    }

    /// The curve that was given.
    pub fn given(&self) -> Option<ToneCurve> {
        self.exposure.map(ToneCurve::with_exposure)
    }

    /// The curve of radiosity for meshes: that of a picture of them, unless it is black.
    pub fn of_meshes(&self, image: Option<&RadianceImage>, light: &GatheredMesh) -> ToneCurve {
        let image = image.filter(|image| self.exposure.is_some() || is_lit(image));
        match image.map(|image| self.of_picture(image)).or_else(|| self.given()) {
            Some(tone) => tone.of_radiosity(),
            None => ToneCurve::fit(&light.surface.radiosity),
        }
    }
}

/// Settings of a GLB file of light with this `error`, a share, whose unit of length is `metres`, in
/// the colours of `tone`, a curve of radiosity.
pub fn glb_settings(tone: &ToneCurve, metres: f64, error: f64) -> GlbSettings {
    let mut settings = GlbSettings::from(tone);
    settings.metres = metres;
    settings.error = error;
    settings
}

/// Whether a picture shows any light.
pub fn is_lit(image: &RadianceImage) -> bool {
    image.pixels.iter().any(|c| c.max_element() > 0.0)
}
