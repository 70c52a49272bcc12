//! Panes that the light which is spread passes: how much of it passes each triangle.
//!
//! ```text
//!     ── τ ──▶ │ pane                  light passes it straight on, × τ
//!
//!     ── √τ ─▶ ┌──────┐ ── √τ ─▶       a body: × √τ at each crossing of its surface, × τ for
//!              └──────┘                all of it
//! ```
//!
//! Each crossing of a body counts the same from either side, so that light takes every way back as
//! it came, also where one end of it is within the body: exchange areas stay symmetric. A sheet
//! that is there twice counts once: of triangles with the same corners the first counts, and two
//! layers that are cut along other diagonals are a body without thickness.
//!
//! Neither Fresnel's reflection nor refraction counts here; pictures have both.

use super::glass_bodies::GlassBodies;
use super::{Material, Rgb, Scene, Specular};

/// What passes the triangles of a scene.
#[derive(Clone, Debug)]
pub(crate) struct ClearPanes {
    /// Per triangle the share of light per channel that passes it once, from either side; none for
    /// triangles that are not clear.
    transmittance: Vec<Option<Rgb>>,
}

impl ClearPanes {
    /// Those of `scene`; none if it has none.
    pub fn new(scene: &Scene) -> Option<ClearPanes> {
        let of_material: Vec<Option<Rgb>> =
            scene.materials().iter().map(Material::clear_transmittance).collect();
        let of = |t: usize| of_material[scene.triangles()[t].material as usize];
        let count = scene.triangles().len();
        if !(0..count).any(|t| of(t).is_some()) {
            return None;
        }
        let glass = GlassBodies::new(scene);
        let transmittance = |t: usize| Some(of(t)?.powf(glass.crossing(t)));
        Some(ClearPanes { transmittance: (0..count).map(transmittance).collect() })
    }

    /// Those of a scene made of pieces of these triangles: of each piece the one it is cut from.
    pub fn of_pieces(&self, triangles: impl Iterator<Item = usize>) -> ClearPanes {
        ClearPanes { transmittance: triangles.map(|t| self.transmittance[t]).collect() }
    }

    /// The share per channel that passes triangle `t` once; none if it is not clear.
    pub fn transmittance(&self, t: usize) -> Option<Rgb> {
        self.transmittance[t]
    }
}

impl Material {
    /// The share of light per channel that passes a pane or body of it straight on; none where it
    /// blocks light. Glass with a diffuse part blocks light and reflects that part.
    pub(crate) fn clear_transmittance(&self) -> Option<Rgb> {
        match self.specular {
            Some(Specular::Glass { transmittance, .. })
                if transmittance != Rgb::ZERO && !self.reflects() && self.exitance == Rgb::ZERO =>
            {
                Some(transmittance)
            }
            _ => None,
        }
    }
}
