//! What all further bounces add to the light that vertices gathered.
//!
//! With L = E + ρF S gathered from S, the light that settles is L + Σ (ρF)ⁿ (L − S) over n ≥ 1.
//! Rays are cast once from every vertex; what they find of L − S is the first bounce, and the
//! vertices [exchange](super::exchange) it until it is used up. The same rays see both lights, so
//! noise is that of the small difference, and few rays do.

use std::ops::ControlFlow;

use super::RadiosityField;
use super::exchange::{Place, SeenPlace, settle};
use super::point_row::{PointRow, PointRows, SurfaceHit, SurfaceRows};
use super::sampled_mesh::SampledMesh;
use super::vertex_rows::{VertexRow, VertexRows};
use crate::scene::Rgb;

/// The light that vertices gathered, and what they gathered it from.
pub(super) struct GatheredFrom<'a> {
    pub samples: &'a SampledMesh,
    /// The light of `samples`, on its mesh.
    pub light: RadiosityField<'a>,
    pub source: RadiosityField<'a>,
}

impl GatheredFrom<'_> {
    /// What all further bounces add to the reflected radiosity of each vertex, W/m², by rows of
    /// `maker`: until all bounces together add less than a thousandth of `floor` (W/m²). Surfaces
    /// nearer than `touching` (scene unit) touch. None where `progress` broke, which is told how
    /// many of the vertices have cast their rays.
    pub fn further_bounces(
        &self,
        maker: &dyn PointRows,
        (touching, floor): (f64, f64),
        progress: impl FnMut(usize) -> ControlFlow<()>,
    ) -> Option<Vec<Rgb>> {
        let SampledMesh { mesh, vertices, .. } = self.samples;
        let maker = SurfaceRows { maker, source: self.source.mesh };
        let rows = VertexRows::new(mesh, vertices, touching, &maker);
        let all = 0..vertices.positions.len() as u32;
        let gathering: Vec<u32> = all.filter(|&v| rows.albedo(v) != Rgb::ZERO).collect();
        let place = |v: u32, row: &VertexRow| self.place(&rows, v, row);
        let found = rows.map(&gathering, 1, place, progress)?;
        let mut places = vec![Place::default(); vertices.positions.len()];
        for (v, place) in gathering.into_iter().zip(found) {
            places[v as usize] = place;
        }
        Some(settle(&places, floor))
    }

    /// Vertex `v` as a place that exchanges light with others; darkness where it is buried.
    fn place(
        &self,
        rows: &VertexRows,
        v: u32,
        VertexRow { front, behind, buried }: &VertexRow,
    ) -> Place {
        if *buried {
            return Place::default();
        }
        let mut difference = Rgb::ZERO;
        let mut seen = vec![];
        let sides: [&[PointRow]; 2] = [front, behind];
        for (share, side) in rows.shares_of_sides(v).into_iter().zip(sides) {
            for row in side {
                for hit in &row.hits {
                    let share = share * row.share * hit.passed;
                    difference += share * self.difference_at(hit);
                    let e = hit.element as usize;
                    if let Some(corner) = self.nearest_corner(hit) {
                        seen.push((corner, share * self.samples.mesh.relative_reflectance(e)));
                    }
                }
            }
        }
        let albedo = rows.albedo(v);
        Place { albedo, constant: albedo * difference, seen: SeenPlace::merged(seen) }
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
