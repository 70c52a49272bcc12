//! Vertices in the dark: under something that touches their surface.

use glam::{DMat3, DVec3};

use super::adaptive::AdaptiveGather;
use crate::scene::Rgb;

/// How far from the light covered vertices are filled: as far as elements that reach it have.
const RINGS: usize = 3;

impl AdaptiveGather<'_> {
    /// Gives covered vertices what their neighbours in the light say, extrapolated along the slope
    /// that the light has there; the nearest first.
    pub(super) fn uncover(&mut self) {
        let mut known: Vec<bool> = self.covered.iter().map(|c| !c).collect();
        if known.iter().all(|&k| k) {
            return;
        }
        let position = |v: u32| self.vertices.positions[v as usize];
        let slopes = self.slopes();
        for ring in 0..RINGS {
            let mut sums = vec![(Rgb::ZERO, 0.0); known.len()];
            for (_, rim) in self.vertices.rims.iter() {
                for &v in rim.iter().filter(|&&v| !known[v as usize]) {
                    for &w in rim.iter().filter(|&&w| known[w as usize]) {
                        let (from, step) = (self.reflected[w as usize], position(v) - position(w));
                        let rise = if ring == 0 { slopes[w as usize] * step } else { Rgb::ZERO };
                        let value = (from + rise).clamp(from * 0.5, from * 2.0);
                        sums[v as usize].0 += value / step.length();
                        sums[v as usize].1 += 1.0 / step.length();
                    }
                }
            }
            for (v, (sum, weight)) in sums.into_iter().enumerate() {
                if weight > 0.0 {
                    self.reflected[v] = sum / weight;
                    known[v] = true;
                }
            }
        }
    }

    /// Gradient of the reflected radiosity at each vertex, W/m² per scene unit: a matrix that takes
    /// a step to a change. From the elements around it that are in the light, weighted by area.
    fn slopes(&self) -> Vec<DMat3> {
        let mut sums = vec![(DMat3::ZERO, 0.0); self.reflected.len()];
        for (e, corners) in self.vertices.corners.iter().enumerate() {
            if corners.iter().any(|&v| self.covered[v as usize]) {
                continue;
            }
            let [a, b, c] = corners.map(|v| self.vertices.positions[v as usize]);
            let [p, q, r] = corners.map(|v| self.reflected[v as usize]);
            let (u, v) = (b - a, c - a);
            let n = u.cross(v);
            // The dual basis of the two edges: 1 along its own, 0 along the other.
            let (du, dv) = (v.cross(n) / n.length_squared(), n.cross(u) / n.length_squared());
            let outer = |x: Rgb, y: DVec3| DMat3::from_cols(x * y.x, x * y.y, x * y.z);
            let slope = outer(q - p, du) + outer(r - p, dv);
            let area = self.mesh.area(self.mesh.element(e));
            for &v in corners {
                sums[v as usize].0 += slope * area;
                sums[v as usize].1 += area;
            }
        }
        sums.into_iter().map(|(s, area)| if area > 0.0 { s * (1.0 / area) } else { s }).collect()
    }
}
