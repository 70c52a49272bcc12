//! Rooms and plates of which every band has a closed form.

use std::f64::consts::PI;

use radiosity::bands::{BandMaterial, Bands};
use radiosity::glam::DVec3;
use radiosity::scene::{IntensityDistribution, Luminaire};
use radiosity::{Material, Rgb, Sky, Sun};

use super::{bake, glow, glowing, largest, light, numbered};
use crate::common::cube;
use crate::common::scenes::{facing_up, quads};

/// A furnace: in a closed room in which all emits E and reflects ρ, B = E / (1 − ρ).
#[test]
fn furnace_has_its_closed_form_in_every_band() {
    let reflectance: Vec<f64> =
        (0..=18).map(|k| f64::from(k) * 0.05).chain([0.95, 0.98, 0.99]).collect();
    let exitance: Vec<f64> = (1..=reflectance.len()).map(|b| b as f64).collect();
    let baked = bake(cube(&glow()), 0.5, 64);
    let materials = vec![glowing(reflectance.clone(), exitance.clone()); 6];
    let bands = Bands { materials, ..Bands::dark(numbered(reflectance.len())) };
    let light = light(&bands, &baked);
    for (b, (rho, emitted)) in reflectance.iter().zip(&exitance).enumerate() {
        let exact = emitted / (1.0 - rho);
        let values = light.radiosity.iter().skip(b).step_by(reflectance.len());
        let worst = largest(values.map(|&value| (value / exact - 1.0).abs()));
        // Light left out is at most 1e-4 of what is reflected; rows are kept in 32 bits, each
        // share off by 2⁻²⁴ at most, and B by that over 1 − ρ.
        let tolerance = 1e-4 * rho + f64::from(f32::EPSILON) / 2.0 / (1.0 - rho);
        assert!(worst <= tolerance, "ρ {rho}: {worst:e} off, after {} sweeps", light.sweeps[b]);
        // All rays see the same: no noise but rounding.
        assert!(light.errors[b].noise < 1e-9 && light.errors[b].remainder <= 1e-4);
    }
}

/// A plate alone under a uniform sky of radiance L receives π L, and from a sun at an angle θ to
/// its normal S cos θ.
#[test]
fn plate_under_sky_and_sun_has_its_closed_form() {
    let plate = [(facing_up([0.0, 1.0], [0.0, 1.0], 0.0), Material::grey("plate", 0.5))];
    let towards = DVec3::new(0.0, 0.6, 0.8);
    let sun = Sun { direction: towards, irradiance: Rgb::ONE };
    let sky = Sky::uniform(Rgb::ONE).with_sun(sun).unwrap();
    let baked = bake(quads(&plate).with_sky(sky).unwrap(), 1.0, 64);
    let bands = Bands {
        materials: vec![BandMaterial::opaque(vec![0.2, 0.9, 0.5])],
        sky: vec![1.0, 0.0, 2.0],
        sun: vec![0.0, 3.0, 1.0],
        ..Bands::dark(numbered(3))
    };
    let light = light(&bands, &baked);
    for v in 0..light.surface.positions.len() {
        let found = light.irradiance_at(v).iter().zip(light.radiosity_at(v));
        let exact = [(0.2, PI), (0.9, 3.0 * 0.8), (0.5, 2.0 * PI + 0.8)];
        for ((irradiance, radiosity), (rho, exact)) in found.zip(exact) {
            assert!((irradiance / exact - 1.0).abs() < 1e-12, "{irradiance} for {exact}");
            assert!((radiosity / (rho * exact) - 1.0).abs() < 1e-12, "{radiosity}");
        }
    }
}

/// A plate under a lamp that is a point of intensity I receives I cos θ / d².
#[test]
fn plate_under_a_luminaire_has_its_closed_form() {
    let plate = [(facing_up([0.0, 1.0], [0.0, 1.0], 0.0), Material::grey("plate", 0.5))];
    let at = DVec3::new(0.3, 0.4, 0.8);
    let intensity = IntensityDistribution::isotropic(2.0).unwrap();
    let lamp = Luminaire::new(intensity, at, -DVec3::Z);
    let baked = bake(quads(&plate).with_luminaires(vec![lamp]).unwrap(), 1.0, 64);
    let scale = [3.0, 0.0, 0.25];
    let bands = Bands {
        materials: vec![BandMaterial::opaque(vec![0.2, 0.9, 0.5])],
        luminaires: vec![scale.to_vec()],
        ..Bands::dark(numbered(3))
    };
    let light = light(&bands, &baked);
    for (v, position) in light.surface.positions.iter().enumerate() {
        let to = at - *position;
        let exact = 2.0 * to.z / to.length().powi(3);
        for (found, scale) in light.irradiance_at(v).iter().zip(scale) {
            // Vertices at the edge gather a hundredth of an element inside: by three times that
            // over the distance, more or less. In red, green and blue as well.
            assert!((found - scale * exact).abs() <= 0.03 * scale * exact, "{found} {exact}");
            let baked = baked.light.surface.irradiance[v].x;
            assert!((found - scale * baked).abs() <= 1e-12 * baked, "{found} {baked}");
        }
    }
}

/// A translucent plate under a sky that is seen from above and below: π L on both sides, of which
/// ρ + τ leaves each.
#[test]
fn translucent_plate_lets_light_of_each_band_through() {
    let leaf = Material { transmittance: Rgb::splat(0.3), ..Material::grey("leaf", 0.3) };
    let plate = [(facing_up([0.0, 1.0], [0.0, 1.0], 0.0), leaf)];
    let baked = bake(quads(&plate).with_sky(Rgb::ONE).unwrap(), 1.0, 64);
    let leaf = BandMaterial {
        transmittance: vec![0.5, 0.0, 0.25],
        ..BandMaterial::opaque(vec![0.25, 0.5, 0.0])
    };
    let bands =
        Bands { materials: vec![leaf], sky: vec![1.0, 1.0, 4.0], ..Bands::dark(numbered(3)) };
    let light = light(&bands, &baked);
    assert!(light.surface.positions.len() >= 8, "two sides");
    for v in 0..light.surface.positions.len() {
        for (found, share) in light.radiosity_at(v).iter().zip([0.75, 0.5, 1.0]) {
            assert!((found / (share * PI) - 1.0).abs() < 1e-12, "{found} for {share} π");
        }
    }
}
