//! A scene whose triangles are cut into pieces.

use std::sync::{Arc, OnceLock};

use glam::{DVec2, DVec3};

use super::derived::Derived;
use super::{Scene, Shape, Triangle};

/// A piece of a triangle of a scene.
pub(crate) struct Piece {
    /// Positions of its corners, scene unit.
    pub corners: [DVec3; 3],
    /// Weights of the triangle's second and third corner at each corner.
    pub weights: [[f64; 2]; 3],
    /// Sides, from corner k to k + 1, across which the surface does not continue.
    pub cut: [bool; 3],
}

impl Piece {
    /// The whole of a triangle with these `corners`.
    pub fn whole(corners: [DVec3; 3]) -> Piece {
        Piece { corners, weights: [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], cut: [false; 3] }
    }
}

impl Scene {
    /// The same surfaces in `pieces` of each triangle.
    pub(crate) fn cut(&self, pieces: Vec<Vec<Piece>>) -> Scene {
        let mut scene = Scene { triangles: vec![], ..self.clone() };
        let mut textures = (*self.textures).clone();
        textures.coordinates.clear();
        textures.colours.clear();
        textures.relative_exitance.clear();
        textures.solid_shares.clear();
        scene.cut_sides.clear();
        let count = pieces.iter().map(Vec::len).sum();
        let of_cut: usize = pieces.iter().map(Vec::len).filter(|&pieces| pieces > 1).sum();
        scene.positions.reserve_exact(3 * of_cut);
        scene.triangles.reserve_exact(count);
        scene.cut_sides.reserve_exact(count);
        let mut firsts = vec![0];
        for (t, pieces) in pieces.into_iter().enumerate() {
            let is_whole = pieces.len() == 1;
            for piece in pieces {
                let corners = match is_whole {
                    true => self.triangles[t].corners,
                    false => piece.corners.map(|position| {
                        scene.positions.push(position);
                        scene.positions.len() as u32 - 1
                    }),
                };
                scene.triangles.push(Triangle { corners, ..self.triangles[t] });
                scene.cut_sides.push(piece.cut);
                if let Some([a, b, c]) = self.texture_coordinates(t) {
                    let point = |[u, v]: [f64; 2]| -> DVec2 { a * (1.0 - u - v) + b * u + c * v };
                    textures.coordinates.push(piece.weights.map(point));
                }
                if !self.textures.colours.is_empty() {
                    let colours = piece.weights.map(|at| self.colour(t, at).as_vec3());
                    textures.colours.push(colours);
                }
                textures.relative_exitance.extend(self.textures.relative_exitance.get(t));
            }
            firsts.push(scene.triangles.len() as u32);
        }
        scene.textures = Arc::new(textures);
        scene.shape = Arc::new(Shape {
            covered_backs: OnceLock::from(self.covered_backs().cut(&firsts)),
            clear_panes: OnceLock::from(self.clear_panes().map(|panes| panes.cut(&firsts))),
            derived: Derived::default(),
        });
        if self.has_cut_outs() {
            scene.find_solid_shares();
        }
        scene
    }

    /// Whether the surface does not continue across side `k` of triangle `t`.
    pub(crate) fn is_cut(&self, t: usize, k: usize) -> bool {
        self.cut_sides.get(t).is_some_and(|sides| sides[k])
    }
}
