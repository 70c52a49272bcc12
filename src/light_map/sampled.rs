//! Sampling of a light map as in renderers: values between the centres of texels.

use super::footprint::Footprint;
use super::gathered::LightMap;
use crate::error::Error;
use crate::mesh::Mesh;
use crate::scene::Rgb;
use crate::vertex::VertexMesh;

impl LightMap {
    /// The irradiance that the map shows at a point of triangle `t` of its scene, whose second and
    /// third corner have these weights: interpolated bilinearly, W/m² per channel.
    pub fn irradiance_at(&self, t: usize, weights: [f64; 2]) -> Rgb {
        Footprint::of(self.atlas.texel_position(t, weights), self.atlas.size)
            .value(&self.irradiance)
    }

    /// The scene lit by the map, with elements about as large as texels that each have their own
    /// vertices: nothing is shared, so that seams of the map show. Radiosity is that of materials
    /// without their textures.
    ///
    /// # Errors
    /// Those of [`Mesh::new`] for too many elements.
    pub fn surface(&self) -> Result<VertexMesh, Error> {
        let mesh = Mesh::new(self.atlas.scene().clone(), self.atlas.texel_size())?;
        let mut surface = VertexMesh { sky: mesh.scene().sky().clone(), ..Default::default() };
        for e in 0..mesh.element_count() {
            let node = mesh.element(e);
            let (t, material, first) =
                (mesh.triangle(node), mesh.material(node), surface.positions.len() as u32);
            for corner in mesh.corners(node) {
                let irradiance = self.irradiance_at(t, mesh.scene().barycentric(t, corner));
                surface.positions.push(corner);
                surface.normals.push(mesh.normal(node));
                surface.irradiance.push(irradiance);
                surface.radiosity.push(material.exitance + material.albedo() * irradiance);
            }
            surface.faces.push([first, first + 1, first + 2]);
            surface.elements.push(e as u32);
        }
        Ok(surface)
    }
}
