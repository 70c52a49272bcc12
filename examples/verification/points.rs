//! Light and heat at points.

use std::f64::consts::PI;

use glam::DVec3;
use radiosity::gather::{GatherPoint, RadiosityField};
use radiosity::{Backend, Mesh, Rgb, Scene};

use crate::Result;
use crate::case::Case;
use crate::scenes::{facing_down, facing_up, lamp, quads};

/// F from a point to a parallel rectangle a × b at the distance c, one corner of which is opposite
/// (Howell B-3).
fn to_corner(a: f64, b: f64, c: f64) -> f64 {
    let (x, y) = (a / c, b / c);
    let (p, q) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
    (x / p * (y / p).atan() + y / q * (x / q).atan()) / (2.0 * PI)
}

/// What a square of 2 × 2, black and at 1273.15 K with this emission, sends to points before its
/// middle and its corner.
pub fn flux_from_a_square(emission: f64) -> Result<Vec<Case>> {
    let mut cases = vec![];
    for distance in [1.0, 2.0, 5.0] {
        let plate = facing_down([-1.0, 1.0], [-1.0, 1.0], distance);
        let scene = quads(&[
            (plate, lamp([emission; 3])),
            (facing_up([9.0, 10.0], [0.0, 1.0], 0.0), lamp([0.0; 3])),
        ]);
        let places = [
            ("middle", DVec3::ZERO, 4.0 * to_corner(1.0, 1.0, distance)),
            ("corner", DVec3::new(1.0, 1.0, 0.0), to_corner(2.0, 2.0, distance)),
        ];
        for (place, position, factor) in places {
            cases.push(Case {
                name: format!(
                    "point {distance} m before the {place} of a square of 2 m at 1000 °C"
                ),
                source:
                    "closed form, Howell B-3; as FDS plate_view_factor, radiating_polygon_square"
                        .into(),
                quantity: "heat flux, W/m²".into(),
                right: emission * factor,
                here: irradiance(&scene, position)?,
                band: 1e-12 * emission * factor,
            });
        }
    }
    Ok(cases)
}

/// Irradiance at a point that looks up.
pub fn irradiance(scene: &Scene, position: DVec3) -> Result<f64> {
    let mesh = Mesh::new(scene.clone(), f64::INFINITY)?;
    let corners = vec![[0; 3]; mesh.element_count()];
    let field = RadiosityField { mesh: &mesh, corners: &corners, reflected: &[Rgb::ZERO] };
    let point = GatherPoint { position, normal: DVec3::Z, near: 1e-7 };
    Ok(Backend::Cpu.gather(&mesh, 1 << 14)?.gather(&field, &[point])?[0].irradiance.x)
}
