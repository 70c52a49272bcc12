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

use super::rgb::Rgb;

/// What passes the triangles of a scene.
#[derive(Clone, Debug)]
pub(crate) struct ClearPanes {
    /// Per triangle the share of light per channel that passes it once, from either side; none for
    /// triangles that are not clear.
    pub transmittance: Vec<Option<Rgb>>,
}

impl ClearPanes {
    /// The same where triangle t is cut into the pieces from `firsts[t]` to `firsts[t + 1]`.
    pub fn cut(&self, firsts: &[u32]) -> ClearPanes {
        let of_pieces = |(of_triangle, ends): (&Option<Rgb>, &[u32])| {
            vec![*of_triangle; (ends[1] - ends[0]) as usize]
        };
        let all = self.transmittance.iter().zip(firsts.windows(2));
        ClearPanes { transmittance: all.flat_map(of_pieces).collect() }
    }

    /// The share per channel that passes triangle `t` once; none if it is not clear.
    pub fn transmittance(&self, t: usize) -> Option<Rgb> {
        self.transmittance[t]
    }
}
