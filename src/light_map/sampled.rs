//! Sampling of a light map as in renderers: values between the centres of texels.

use glam::DVec3;
use rustc_hash::FxHashMap;

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

    /// The scene lit by the map, in elements with edges of up to two texels. Vertices are shared
    /// within charts alone, so that seams of the map show. Radiosity is that of materials without
    /// their textures.
    ///
    /// # Errors
    /// Those of [`Mesh::new`] for too many elements.
    pub fn surface(&self) -> Result<VertexMesh, Error> {
        let scene = self.atlas.scene();
        let mut surface = VertexMesh { sky: scene.sky().clone(), ..Default::default() };
        let mut numbers: FxHashMap<[u32; 5], u32> = FxHashMap::default();
        for (e, element) in (0..).zip(self.elements()?) {
            let (t, material) = (element.triangle, scene.material(element.triangle));
            let number = |k: usize| {
                let (position, weights) = (element.corners[k], element.weights[k]);
                // Each smooth surface has texels of its own. In 32 bits neighbours agree.
                let [x, y, z] = position.as_vec3().to_array().map(f32::to_bits);
                let texel = self.atlas.texel_position(t, weights).as_vec2();
                let [u, v] = texel.to_array().map(f32::to_bits);
                *numbers.entry([x, y, z, u, v]).or_insert_with(|| {
                    let irradiance = self.irradiance_at(t, weights);
                    surface.positions.push(position);
                    surface.normals.push(scene.normal(t));
                    surface.irradiance.push(irradiance);
                    surface.radiosity.push(material.exitance + material.albedo() * irradiance);
                    surface.positions.len() as u32 - 1
                })
            };
            surface.faces.push([0, 1, 2].map(number));
            surface.elements.push(e);
        }
        Ok(surface)
    }

    /// The triangles of the scene in elements with edges of up to two texels.
    pub(crate) fn elements(&self) -> Result<impl Iterator<Item = MapElement>, Error> {
        // A quarter of the elements with edges of a texel: plain choice between detail and size.
        let mesh = Mesh::new(self.atlas.scene().clone(), 2.0 * self.atlas.texel_size())?;
        Ok((0..mesh.element_count()).map(move |e| {
            let node = mesh.element(e);
            let (triangle, corners) = (mesh.triangle(node), mesh.corners(node));
            let weights = corners.map(|corner| mesh.scene().barycentric(triangle, corner));
            MapElement { triangle, corners, weights }
        }))
    }
}

/// An element of a scene that a map lights.
pub(crate) struct MapElement {
    pub triangle: usize,
    /// Its corners, scene unit.
    pub corners: [DVec3; 3],
    /// Of each corner, the weights of the triangle's second and third corner.
    pub weights: [[f64; 2]; 3],
}
