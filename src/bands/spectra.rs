//! Bands, and the values of materials and outside light in each.

use std::collections::HashSet;

use crate::error::{Error, ErrorKind, quoted};
use crate::scene::{Material, Rgb, Scene};

/// A band of light.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Band {
    /// Its name, of ASCII letters, digits and any of `_ - .`: it is used in names in files.
    pub name: String,
    /// Wavelength in nm, where values are spectral, per nm.
    pub wavelength: Option<f64>,
}

/// Optical properties of a material, one value per band each.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BandMaterial {
    /// Share of arriving light that leaves diffusely from the same side, in [0, 1).
    pub reflectance: Vec<f64>,
    /// Share that leaves diffusely from the other side; its sum with the reflectance is in [0, 1).
    pub transmittance: Vec<f64>,
    /// Emitted flux per area, W/m², or W/(m² nm) of a spectrum.
    pub exitance: Vec<f64>,
}

/// The bands of a scene, and the values of its materials and its sky in each.
///
/// Textures of reflectance and emission are ignored: a material is uniform, and only holes are
/// kept. A clear pane has the mean of its transmittances in red, green and blue, and reflects
/// nothing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Bands {
    /// The bands, in any order.
    pub bands: Vec<Band>,
    /// The materials of the scene, one for one.
    pub materials: Vec<BandMaterial>,
    /// Radiance of a uniform sky, W/(m² sr) by band, instead of the scene's.
    pub sky: Vec<f64>,
    /// Irradiance of a surface that faces the sun, W/m² by band; ignored in a scene without a sun.
    pub sun: Vec<f64>,
    /// Factors on the intensities of each luminaire of the scene, by band, instead of its
    /// [scale](crate::scene::Luminaire::scale).
    pub luminaires: Vec<Vec<f64>>,
}

impl BandMaterial {
    /// A material that neither transmits nor emits.
    pub fn opaque(reflectance: Vec<f64>) -> BandMaterial {
        let nothing = vec![0.0; reflectance.len()];
        BandMaterial { reflectance, transmittance: nothing.clone(), exitance: nothing }
    }

    /// Share of arriving light that leaves again diffusely, on either side, in band `b`.
    pub(super) fn albedo(&self, b: usize) -> f64 {
        self.reflectance[b] + self.transmittance[b]
    }

    fn check(&self, material: &Material, bands: &[Band]) -> Result<(), Error> {
        let place =
            |b: usize| format!("material {} in band {}", quoted(&[&material.name]), bands[b].name);
        let wrong = |b: usize, found: String, remedy: &str| {
            Err(Error::new(ErrorKind::Scene, place(b), found, remedy))
        };
        for (values, what) in [
            (&self.reflectance, "values of reflectance"),
            (&self.transmittance, "values of transmittance"),
            (&self.exitance, "values of exitance"),
        ] {
            check_count(values, what, bands, &format!("material {}", quoted(&[&material.name])))?;
        }
        for b in 0..bands.len() {
            let (rho, tau, e) = (self.reflectance[b], self.transmittance[b], self.exitance[b]);
            if !(rho >= 0.0 && tau >= 0.0 && rho + tau < 1.0) {
                let found = format!("reflectance {rho} and transmittance {tau}");
                return wrong(b, found, "must be at least 0, and together below 1");
            }
            if tau > 0.0 && !material.is_translucent() {
                let found = format!("transmittance {tau}, and the scene's material is opaque");
                return wrong(b, found, "make it translucent in red, green or blue too");
            }
            if !(e.is_finite() && e >= 0.0) {
                let found = format!("exitance {e}");
                return wrong(b, found, "must be finite and not negative");
            }
        }
        Ok(())
    }
}

impl Bands {
    /// These bands without a material, under a black sky.
    pub fn dark(bands: Vec<Band>) -> Bands {
        let nothing = vec![0.0; bands.len()];
        let (materials, luminaires) = (vec![], vec![]);
        Bands { bands, materials, sky: nothing.clone(), sun: nothing, luminaires }
    }

    /// The three bands `r`, `g` and `b` of a scene itself, without its textures. The sky is that of
    /// the scene if it is uniform, else black.
    pub fn of_rgb(scene: &Scene) -> Bands {
        let values = |rgb: Rgb| rgb.to_array().to_vec();
        let material = |m: &Material| BandMaterial {
            reflectance: values(m.reflectance),
            transmittance: values(m.transmittance),
            exitance: values(m.exitance),
        };
        let sky = scene.sky();
        Bands {
            bands: ["r", "g", "b"].map(|name| Band { name: name.into(), wavelength: None }).into(),
            materials: scene.materials().iter().map(material).collect(),
            sky: values(sky.uniform_radiance().unwrap_or_default()),
            sun: values(sky.sun().map_or(Rgb::ZERO, |sun| sun.irradiance)),
            luminaires: scene.luminaires().iter().map(|lamp| values(lamp.scale)).collect(),
        }
    }

    /// Checks that all values for `scene` exist and are in range.
    ///
    /// # Errors
    /// [`ErrorKind::Scene`] for no band, a duplicate or invalid name, a wrong number of materials
    /// or values, values out of range.
    pub fn check(&self, scene: &Scene) -> Result<(), Error> {
        let wrong = |place: &str, found: String, remedy: &str| {
            Err(Error::new(ErrorKind::Scene, place, found, remedy))
        };
        if self.bands.is_empty() {
            return wrong("bands", "none".into(), "give one or more");
        }
        let mut names = HashSet::new();
        for Band { name, wavelength } in &self.bands {
            let is_plain = |c: char| c.is_ascii_alphanumeric() || "_-.".contains(c);
            if name.is_empty() || !name.chars().all(is_plain) {
                let remedy = "use letters, digits and _ - . of ASCII";
                return wrong("bands", format!("the name {}", quoted(&[name])), remedy);
            }
            if !names.insert(name) {
                return wrong("bands", format!("two named {name}"), "give each its own name");
            }
            if wavelength.is_some_and(|nm| !(nm.is_finite() && nm > 0.0)) {
                let found = format!("a wavelength of {} nm", wavelength.unwrap_or_default());
                return wrong(&format!("band {name}"), found, "give one above 0");
            }
        }
        for (place, found, wanted) in [
            ("materials of bands", self.materials.len(), scene.materials().len()),
            ("luminaires of bands", self.luminaires.len(), scene.luminaires().len()),
        ] {
            if found != wanted {
                let remedy = format!("give one for each of the scene's {wanted}");
                return wrong(place, format!("{found} of them"), &remedy);
            }
        }
        let luminaires = self.luminaires.iter().map(|values| (values, "luminaire"));
        for (values, place) in
            [(&self.sky, "sky"), (&self.sun, "sun")].into_iter().chain(luminaires)
        {
            check_count(values, "values", &self.bands, place)?;
            if let Some(bad) = values.iter().find(|x| !(x.is_finite() && **x >= 0.0)) {
                return wrong(place, format!("{bad} in a band"), "give at least 0, and finite");
            }
        }
        let mut both = self.materials.iter().zip(scene.materials());
        both.try_for_each(|(of_bands, material)| of_bands.check(material, &self.bands))
    }

    /// Names of materials that reflect or emit in some band and are black in `scene`: its mesh is
    /// not refined for their light, which the bake did not include.
    pub fn unseen_by(&self, scene: &Scene) -> Vec<String> {
        let some = |values: &[f64]| values.iter().any(|&x| x > 0.0);
        let unseen = |(of_bands, material): &(&BandMaterial, &Material)| {
            let scatters = material.scatters() || material.clear_transmittance().is_some();
            some(&of_bands.reflectance) && !scatters
                || some(&of_bands.exitance) && material.exitance == Rgb::ZERO
        };
        let both = self.materials.iter().zip(scene.materials());
        both.filter(unseen).map(|(_, material)| material.name.clone()).collect()
    }
}

fn check_count(values: &[f64], what: &str, bands: &[Band], place: &str) -> Result<(), Error> {
    if values.len() == bands.len() {
        return Ok(());
    }
    let (found, remedy) = (format!("{} {what}", values.len()), format!("give {}", bands.len()));
    Err(Error::new(ErrorKind::Scene, place, found, remedy))
}
