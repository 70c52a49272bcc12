//! What renderers make of a light map: values between the centres of texels.

use glam::DVec2;

use super::gathered::LightMap;
use crate::error::Error;
use crate::mesh::Mesh;
use crate::scene::Rgb;
use crate::vertex::VertexMesh;

/// The four texels around a place, and how much each counts: bilinear interpolation.
#[derive(Clone, Copy, Debug)]
pub(super) struct Footprint {
    pub texels: [u32; 4],
    pub weights: [f64; 4],
}

impl Footprint {
    /// Of a place in units of texels; those beyond the border count as the ones on it.
    pub fn of(place: DVec2, [width, height]: [u32; 2]) -> Footprint {
        let axis = |x: f64, count: u32| {
            let x = x.clamp(0.0, f64::from(count - 1));
            let first = (x.floor() as u32).min(count.saturating_sub(2));
            (first, (first + 1).min(count - 1), x - f64::from(first))
        };
        let (left, right, u) = axis(place.x, width);
        let (above, below, v) = axis(place.y, height);
        let texel = |column: u32, row: u32| row * width + column;
        Footprint {
            texels: [
                texel(left, above),
                texel(right, above),
                texel(left, below),
                texel(right, below),
            ],
            weights: [(1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v],
        }
    }

    /// The value there of a map with these `values`.
    pub fn value(&self, values: &[Rgb]) -> Rgb {
        self.texels.iter().zip(self.weights).map(|(&k, weight)| values[k as usize] * weight).sum()
    }
}

impl LightMap {
    /// The irradiance that the map shows at a point of triangle `t` of its scene, whose second and
    /// third corner have these weights: interpolated bilinearly, W/m² per channel.
    pub fn irradiance_at(&self, t: usize, weights: [f64; 2]) -> Rgb {
        Footprint::of(self.atlas.place(t, weights), self.atlas.size).value(&self.irradiance)
    }

    /// The scene as it looks by the map, with elements about as large as texels that each have
    /// vertices of their own: nothing is shared, so that seams of the map show. Radiosity is that
    /// of materials without their textures.
    ///
    /// # Errors
    /// Those of [`Mesh::new`] where there would be too many.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn linear_values_are_interpolated_exactly() {
        // Value 2x + 3y at centre (x, y) of 5 × 4 texels; clamped beyond them.
        let values: Vec<Rgb> =
            (0..20).map(|k| Rgb::splat(f64::from(2 * (k % 5) + 3 * (k / 5)))).collect();
        for (place, wanted) in
            [([1.25, 2.5], 10.0), ([4.0, 3.0], 17.0), ([-3.0, 1.5], 4.5), ([9.0, 9.0], 17.0)]
        {
            let found = Footprint::of(place.into(), [5, 4]).value(&values);
            assert_eq!(found, Rgb::splat(wanted), "{place:?}");
        }
        assert_eq!(Footprint::of(DVec2::splat(0.3), [1, 1]).value(&values[7..]), values[7]);
    }
}
