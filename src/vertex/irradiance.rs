//! From radiosity to the light behind it: without reflectance, and without textures.

use crate::mesh::Mesh;
use crate::scene::Rgb;

/// Radiosity of elements as if each had the reflectance and exitance of its material, W/m², from
/// the `radiosity` that they have. None without textures, where it is the same.
pub(super) fn untextured(mesh: &Mesh, radiosity: &[Rgb]) -> Option<Vec<Rgb>> {
    let element = |e: usize| {
        let reflected = (radiosity[e] - mesh.exitance(e)).max(Rgb::ZERO);
        let emitted = mesh.material(mesh.element(e)).exitance;
        emitted + reflected / mesh.relative_reflectance(e)
    };
    mesh.scene().has_textures().then(|| (0..radiosity.len()).map(element).collect())
}

/// Irradiance of which `reflected` leaves a surface of this `albedo` again, W/m²: 0, for unknown,
/// where that is 0.
pub(crate) fn irradiance(reflected: Rgb, albedo: Rgb) -> Rgb {
    Rgb::select(albedo.cmpgt(Rgb::ZERO), reflected / albedo, Rgb::ZERO)
}
