//! Light at vertices, and what textured surfaces make of it.
//!
//! ```text
//!   radiosity of elements ─ ÷ ρ of the element, × ρ̄ ─► light at vertices ─ ÷ ρ̄ ─► irradiance
//!                                                            │
//!                                                            └─ ρ, E around it ─► radiosity
//! ```
//!
//! Light is smooth where textures are not. So vertices are given the light that a surface of the
//! material's mean reflectance ρ̄ would reflect, and what the texture does to it comes last: a
//! vertex reflects and emits the means of the elements around it, weighted by area.

use super::VertexMesh;
use super::irradiance::irradiance;
use super::keys::ElementLoops;
use crate::mesh::Mesh;
use crate::scene::Rgb;

impl VertexMesh {
    /// Sets the irradiance of the vertices on the `outlines` of the elements of `mesh`, and their
    /// radiosity where there are textures. `reflected` is the light as if the material of each
    /// vertex reflected alike, W/m².
    pub(crate) fn reflect(&mut self, mesh: &Mesh, outlines: &ElementLoops, reflected: &[Rgb]) {
        self.irradiance = vec![Rgb::ZERO; reflected.len()];
        for (e, outline) in outlines.iter() {
            let albedo = mesh.material(mesh.element(e)).albedo();
            for v in outline.iter().map(|&v| v as usize) {
                self.irradiance[v] = irradiance(reflected[v], albedo);
            }
        }
        if !mesh.scene().has_textures() {
            return;
        }
        let mut sums = vec![(Rgb::ZERO, Rgb::ZERO, 0.0); reflected.len()];
        for (e, outline) in outlines.iter() {
            let area = mesh.weight(mesh.element(e));
            let (relative, emitted) = (mesh.relative_reflectance(e), mesh.exitance(e));
            for &v in outline {
                let sum = &mut sums[v as usize];
                *sum = (sum.0 + area * relative, sum.1 + area * emitted, sum.2 + area);
            }
        }
        for (v, (relative, emitted, area)) in sums.into_iter().enumerate() {
            self.radiosity[v] = (emitted + relative * reflected[v]) / area;
        }
    }
}
