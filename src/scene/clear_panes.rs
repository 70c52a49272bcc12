//! Clear panes in the light solution: transmittance of each triangle.
//!
//! ```text
//!     ── τ ──▶ │ pane                  light passes it straight on, × τ
//!
//!     ── √τ ─▶ ┌──────┐ ── √τ ─▶       a body: × √τ at each crossing of its surface, × τ in
//!              └──────┘                total
//! ```
//!
//! Each crossing of a body counts the same from either side, so that all paths are reversible, even
//! with one end within the body: exchange areas stay symmetric. A duplicated sheet counts once: of
//! triangles with the same corners only the first counts, and two layers cut along other diagonals
//! are a body without thickness.
//!
//! Fresnel reflection and refraction are ignored here; pictures have both.

use super::rgb::Rgb;

/// Transmittance of the triangles of a scene.
#[derive(Clone, Debug)]
pub(crate) struct ClearPanes {
    /// Per triangle the fraction of light per channel that passes it once, from either side; none
    /// for triangles that are not clear.
    pub transmittance: Vec<Option<Rgb>>,
}

impl ClearPanes {
    /// The same for triangles t cut into the pieces from `firsts[t]` to `firsts[t + 1]`.
    pub fn cut(&self, firsts: &[u32]) -> ClearPanes {
        let of_pieces = |(of_triangle, ends): (&Option<Rgb>, &[u32])| {
            vec![*of_triangle; (ends[1] - ends[0]) as usize]
        };
        let all = self.transmittance.iter().zip(firsts.windows(2));
        ClearPanes { transmittance: all.flat_map(of_pieces).collect() }
    }

    /// The fraction per channel that passes triangle `t` once; none if it is not clear.
    pub fn transmittance(&self, t: usize) -> Option<Rgb> {
        self.transmittance[t]
    }
}
