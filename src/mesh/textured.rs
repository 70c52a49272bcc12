//! Reflectance and exitance of elements: of a texture, the mean over the element.

use super::Mesh;
use crate::scene::Rgb;

impl Mesh {
    /// Reflectance of element `e` per channel: that of its material or, of a textured one, the mean
    /// of the texture over the element, at least 1e-9 of the material's.
    pub fn reflectance(&self, e: usize) -> Rgb {
        let of_material = || self.material(self.element(e)).reflectance;
        self.textured_reflectances().get(e).copied().unwrap_or_else(of_material)
    }

    /// Exitance of element `e` per channel, W/m²: that of its triangle
    /// ([`Scene::exitance`](crate::Scene::exitance)).
    pub fn exitance(&self, e: usize) -> Rgb {
        self.scene().exitance(self.triangle(self.element(e)))
    }

    /// Ratio of the reflectances of element `e` and of its material, per channel: 1 without a
    /// texture, and if nothing is reflected.
    pub(crate) fn relative_reflectance(&self, e: usize) -> Rgb {
        let Some(&reflectance) = self.textured_reflectances().get(e) else { return Rgb::ONE };
        let of_material = self.material(self.element(e)).reflectance;
        Rgb::select(of_material.cmpgt(Rgb::ZERO), reflectance / of_material, Rgb::ONE)
    }

    /// Fraction of the light received by element `e` that leaves diffusely, on either side: ρ + τ
    /// per channel. The transmittance τ of a textured material follows its reflectance.
    pub(crate) fn albedo(&self, e: usize) -> Rgb {
        self.reflectance(e) + self.transmittance(e)
    }

    /// Fraction of the light received by element `e` that leaves diffusely from the other side, if
    /// there is one.
    pub(crate) fn transmittance(&self, e: usize) -> Rgb {
        let of_material = self.material(self.element(e)).transmittance;
        if of_material == Rgb::ZERO {
            of_material
        } else {
            of_material * self.relative_reflectance(e)
        }
    }

    /// Reflectance of every element; empty if no material has a texture of it.
    fn textured_reflectances(&self) -> &[Rgb] {
        self.textured_reflectances.get_or_init(|| {
            if !self.scene().has_textured_reflectance() {
                return vec![];
            }
            let nodes: Vec<_> = (0..self.element_count()).map(|e| self.element(e)).collect();
            let piece = |&node: &_| (self.triangle(node), self.cell(node).corners());
            let pieces: Vec<_> = nodes.iter().map(piece).collect();
            let mut reflectances = self.scene().mean_reflectances(&pieces);
            // Negligible, and irradiance can still be computed from the reflected radiosity: 1e9 is
            // far below the 2⁵³ of rounding.
            for (reflectance, &node) in reflectances.iter_mut().zip(&nodes) {
                *reflectance = reflectance.max(1e-9 * self.material(node).reflectance);
            }
            reflectances
        })
    }
}
