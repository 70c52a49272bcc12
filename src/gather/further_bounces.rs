//! The light of all further bounces, beyond that which vertices gathered.
//!
//! With L = E + ρF S gathered from S, the solution is L + Σ (ρF)ⁿ (L − S) over n ≥ 1. Rays are cast
//! once from every vertex; what they gather of L − S is the first bounce, and the vertices
//! [exchange](super::exchange) it until convergence. The same rays gather both lights, so that the
//! noise is that of the small difference, and few rays suffice.

use std::ops::ControlFlow;

use super::RadiosityField;
use super::exchange::{Equation, Term, converge, is_own};
use super::point_row::{PointRow, PointRows, SurfaceHit, SurfaceRows};
use super::sampled_mesh::SampledMesh;
use super::vertex_rows::{VertexRow, VertexRows};
use crate::scene::Rgb;

/// The light that vertices gathered, and its source.
pub(super) struct GatheredFrom<'a> {
    pub samples: &'a SampledMesh,
    /// The light of `samples`, on its mesh.
    pub light: RadiosityField<'a>,
    pub source: RadiosityField<'a>,
}

impl GatheredFrom<'_> {
    /// The reflected radiosity that all further bounces add at each vertex, W/m², by rows of
    /// `maker`; converged to a thousandth of it, or of `floor` (W/m²) where it is less. Surfaces
    /// nearer than `touching` (scene unit) touch. `progress` is called with the number of vertices
    /// that have cast their rays; `None` if it breaks. Black vertices cast none: the second result
    /// is the number of the others.
    pub fn further_bounces(
        &self,
        maker: &dyn PointRows,
        touching: f64,
        floor: f64,
        progress: impl FnMut(usize) -> ControlFlow<()>,
    ) -> Option<(Vec<Rgb>, usize)> {
        let SampledMesh { mesh, vertices, .. } = self.samples;
        let maker = SurfaceRows { maker, source: self.source.mesh };
        let rows = VertexRows::new(mesh, vertices, touching, &maker);
        let all = 0..vertices.positions.len() as u32;
        let gathering: Vec<u32> = all.filter(|&v| rows.albedo(v) != Rgb::ZERO).collect();
        let equation = |v: u32, row: &VertexRow| self.equation(&rows, v, row);
        let keep = |v: u32, equation: Equation| match is_own(v as usize) {
            true => equation,
            false => Equation { terms: vec![], ..equation },
        };
        let mut equations = rows.map(&gathering, 1, equation, keep, progress)?;
        equations.reserve_exact(vertices.positions.len() - gathering.len());
        equations.resize_with(vertices.positions.len(), Equation::default);
        for (k, &v) in gathering.iter().enumerate().rev() {
            equations.swap(k, v as usize);
        }
        Some((converge(&equations, floor), gathering.len()))
    }

    /// The equation of vertex `v`; darkness where it is buried.
    fn equation(
        &self,
        rows: &VertexRows,
        v: u32,
        VertexRow { front, behind, buried }: &VertexRow,
    ) -> Equation {
        if *buried {
            return Equation::default();
        }
        let mut difference = Rgb::ZERO;
        let mut shares = vec![];
        let sides: [&[PointRow]; 2] = [front, behind];
        for (share, side) in rows.shares_of_sides(v).into_iter().zip(sides) {
            for row in side {
                for hit in &row.hits {
                    let share = share * row.share * hit.passed;
                    difference += share * self.difference_at(hit);
                    let e = hit.element as usize;
                    if let Some(corner) = self.nearest_corner(hit) {
                        shares.push((corner, share * self.samples.mesh.relative_reflectance(e)));
                    }
                }
            }
        }
        let albedo = rows.albedo(v);
        Equation { albedo, constant: albedo * difference, terms: Term::merged(shares) }
    }

    /// Reflected radiosity of the light at `hit` less that of its source, W/m².
    fn difference_at(&self, hit: &SurfaceHit) -> Rgb {
        let mesh = &self.samples.mesh;
        let element = hit.element as usize;
        let node = mesh.element(element);
        let [u, v] = mesh.cell(node).in_triangle(hit.barycentric);
        self.light.reflected_on_element(element, hit.barycentric)
            - self.source.reflected_at(mesh.triangle(node), u, v)
    }

    /// The corner nearest to `hit` of its element, of those that are not buried.
    fn nearest_corner(&self, hit: &SurfaceHit) -> Option<u32> {
        let [u, v] = hit.barycentric;
        let corners = self.samples.corners()[hit.element as usize];
        let open = corners.into_iter().zip([1.0 - u - v, u, v]);
        let open = open.filter(|&(corner, _)| !self.samples.buried[corner as usize]);
        open.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(corner, _)| corner)
    }
}
