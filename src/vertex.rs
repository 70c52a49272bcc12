//! From elements to vertices: a triangle mesh that carries radiosity, to be shown or exported.
//!
//! ```text
//!   elements ── keys: which vertices, shared over each smooth surface
//!            ── area-weighted means ── boundary_fit: at the boundary of a smooth surface
//!            ── hanging_nodes: no cracks where element sizes differ ── VertexMesh
//! ```
//!
//! This is the quick way, which sees no more than the elements. The exact one gathers light at each
//! vertex: [`gather_at_vertices`](crate::gather::gather_at_vertices).

mod boundary_fit;
mod face_at;
pub(crate) mod hanging_nodes;
mod irradiance;
pub(crate) mod keys;
mod textured;

use glam::DVec3;
use rayon::prelude::*;

use crate::geometry::incidence::Incidence;
use crate::mesh::{Mesh, SurfaceTopology};
use crate::scene::{Rgb, Sky};
pub(crate) use face_at::FacePlace;
use hanging_nodes::HangingNodes;
pub(crate) use irradiance::irradiance;
use keys::{ElementLoops, Vertices};

/// A triangle mesh with radiosity at its vertices, continuous over each smooth surface and only
/// there.
///
/// A smooth surface is a set of triangles of one group and one material that meet in no crease:
/// at angles up to [`Mesh::CREASE_DEGREES`] in one smoothing group, else up to
/// [`Mesh::COPLANAR_DEGREES`]. Where neighbouring elements differ in size, the larger one is
/// fanned around its centroid over the vertices on its sides, across creases too: no cracks, no
/// T-vertices, and where the scene is watertight so is the mesh, position by position.
#[derive(Clone, Debug, Default)]
pub struct VertexMesh {
    /// Vertex positions, in the scene's length unit.
    pub positions: Vec<DVec3>,
    /// Unit normals: area-weighted over the elements around a vertex.
    pub normals: Vec<DVec3>,
    /// Radiosity B at the vertices, W/m² per channel, linear. On a textured surface a vertex
    /// reflects the mean of the elements around it, weighted by area.
    pub radiosity: Vec<Rgb>,
    /// Irradiance at the vertices, W/m² per channel, linear: what a program with the textures
    /// multiplies with their reflectance. On a translucent surface it is the mean of the
    /// irradiances on both sides, by the shares of them that leave: to be multiplied with ρ + τ.
    /// A channel in which the material is black is not gathered, and 0 here. Empty where it is not
    /// known.
    pub irradiance: Vec<Rgb>,
    /// Standard error of the radiosity at each vertex and over the faces around it, W/m²: a length
    /// over the channels. Empty where it was not estimated.
    pub error: Vec<f64>,
    /// Faces, counter-clockwise from the front, as indices of vertices.
    pub faces: Vec<[u32; 3]>,
    /// For each face, the index of the element that it is, or is a part of.
    pub elements: Vec<u32>,
    /// What is seen where there is no surface: [`Scene::sky`](crate::Scene::sky).
    pub sky: Sky,
    /// Comments for a file's header, one line each.
    pub comments: Vec<String>,
}

impl VertexMesh {
    /// Radiosity at the vertices of `mesh` from that of its elements: one value an element, W/m²
    /// per channel.
    ///
    /// The area-weighted mean of the elements around each vertex; at the boundary of a smooth
    /// surface a linear fit to them (Cohen and Greenberg 1985). No value is below zero. Means
    /// smooth: errors are of first order in the size of the elements where light is not linear.
    ///
    /// Elements of a textured material are averaged as if all of it reflected alike.
    pub fn new(mesh: &Mesh, element_radiosity: &[Rgb]) -> VertexMesh {
        VertexMesh::with_corners(mesh, element_radiosity).0
    }

    /// The same, the vertices at the corners of each element, and the reflected radiosity of these
    /// as if no material were textured, W/m².
    pub(crate) fn with_corners(
        mesh: &Mesh,
        element_radiosity: &[Rgb],
    ) -> (VertexMesh, Vec<[u32; 3]>, Vec<Rgb>) {
        let untextured = irradiance::untextured(mesh, element_radiosity);
        let with_textures = element_radiosity;
        let element_radiosity = untextured.as_deref().unwrap_or(element_radiosity);
        let topology = SurfaceTopology::of_scene(mesh.scene());
        let vertices = Vertices::new(mesh, &topology);
        let outlines = &vertices.outlines;
        let average = VertexAverage::new(mesh, &vertices);
        let normals = average.mean(|e, _| mesh.normal(mesh.element(e)));
        let normals: Vec<DVec3> = normals.into_iter().map(DVec3::normalize_or_zero).collect();
        let mut radiosity = average.mean(|e, _| element_radiosity[e]);
        let positions = &vertices.positions;
        let at_boundary =
            boundary_values(mesh, outlines, positions, &normals, element_radiosity, &radiosity);
        for (v, value) in at_boundary {
            radiosity[v] = value.max(Rgb::ZERO);
        }
        let mut out = VertexMesh {
            radiosity,
            normals,
            positions: positions.clone(),
            sky: mesh.scene().sky().clone(),
            ..Default::default()
        };
        let mut reflected = out.radiosity.clone();
        for (e, outline) in outlines.iter() {
            let emitted = mesh.material(mesh.element(e)).exitance;
            for v in outline.iter().map(|&v| v as usize) {
                reflected[v] = (out.radiosity[v] - emitted).max(Rgb::ZERO);
            }
        }
        out.reflect(mesh, outlines, &reflected);
        let hanging_nodes = HangingNodes::new(mesh, &topology, &vertices);
        out.add_elements(mesh, &hanging_nodes, |_, e| {
            let material = mesh.material(mesh.element(e));
            let reflected = (element_radiosity[e] - material.exitance).max(Rgb::ZERO);
            [with_textures[e], irradiance(reflected, material.albedo())]
        });
        (out, vertices.corners, reflected)
    }

    /// Adds the hanging nodes, and every element of `mesh` as a face, or as a fan where there are
    /// vertices on its sides. `centre_light` gives radiosity and irradiance at the centre of an
    /// element's fan, W/m² per channel.
    pub(crate) fn add_elements(
        &mut self,
        mesh: &Mesh,
        hanging_nodes: &HangingNodes,
        centre_light: impl Fn(&Self, usize) -> [Rgb; 2],
    ) {
        let corners = || hanging_nodes.outlines.iter().map(|(_, outline)| outline.len());
        let fans = corners().filter(|&corners| corners != 3).count();
        let faces = corners().map(|corners| if corners == 3 { 1 } else { corners }).sum();
        let more = hanging_nodes.nodes.len() + fans;
        for values in
            [&mut self.positions, &mut self.normals, &mut self.radiosity, &mut self.irradiance]
        {
            values.reserve_exact(more);
        }
        self.faces.reserve_exact(faces);
        self.elements.reserve_exact(faces);
        for node in &hanging_nodes.nodes {
            let [a, b] = node.between.map(|v| v as usize);
            self.positions.push(node.position);
            self.normals.push((self.normals[a] + self.normals[b]).normalize_or_zero());
            self.radiosity.push((self.radiosity[a] + self.radiosity[b]) / 2.0);
            self.irradiance.push((self.irradiance[a] + self.irradiance[b]) / 2.0);
        }
        for (e, outline) in hanging_nodes.outlines.iter() {
            match *outline {
                [a, b, c] => self.add_face([a, b, c], e),
                _ => self.add_fan(mesh, outline, e, centre_light(self, e)),
            }
        }
    }

    fn add_face(&mut self, face: [u32; 3], e: usize) {
        self.faces.push(face);
        self.elements.push(e as u32);
    }

    /// Adds element `e` as a fan around its centroid, which has this radiosity and irradiance.
    fn add_fan(&mut self, mesh: &Mesh, outline: &[u32], e: usize, centre_light: [Rgb; 2]) {
        let centre = self.positions.len() as u32;
        self.positions.push(mesh.centroid(mesh.element(e)));
        self.normals.push(mesh.normal(mesh.element(e)));
        let [radiosity, irradiance] = centre_light;
        self.radiosity.push(radiosity);
        self.irradiance.push(irradiance);
        for (k, &a) in outline.iter().enumerate() {
            self.add_face([centre, a, outline[(k + 1) % outline.len()]], e);
        }
    }

    /// The same mesh with each element's own value at all its corners: what the solver found,
    /// nothing averaged. `element_radiosity` holds one value an element, W/m² per channel.
    pub fn per_element(mesh: &Mesh, element_radiosity: &[Rgb]) -> VertexMesh {
        let mut out = VertexMesh::default();
        for (e, &radiosity) in element_radiosity.iter().enumerate().take(mesh.element_count()) {
            let node = mesh.element(e);
            let first = out.positions.len() as u32;
            out.positions.extend(mesh.corners(node));
            out.normals.extend([mesh.normal(node); 3]);
            out.radiosity.extend([radiosity; 3]);
            let reflected = (radiosity - mesh.exitance(e)).max(Rgb::ZERO);
            out.irradiance.extend([irradiance(reflected, mesh.albedo(e)); 3]);
            out.faces.push([first, first + 1, first + 2]);
            out.elements.push(e as u32);
        }
        out
    }
}

/// Means over the elements around each vertex, weighted by area.
struct VertexAverage<'a> {
    outlines: &'a ElementLoops,
    /// The elements with each vertex on their outlines.
    around: Incidence,
    /// Area of each element, scene unit squared.
    areas: Vec<f64>,
}

impl VertexAverage<'_> {
    fn new<'a>(mesh: &Mesh, vertices: &'a Vertices) -> VertexAverage<'a> {
        let outlines = &vertices.outlines;
        let around = Incidence::new(vertices.positions.len(), || outlines.iter());
        let areas = outlines.iter().map(|(e, _)| mesh.weight(mesh.element(e))).collect();
        VertexAverage { outlines, around, areas }
    }

    /// The mean at each vertex of what `value` has for an element and its outline.
    fn mean(&self, value: impl Fn(usize, &[u32]) -> DVec3 + Sync) -> Vec<DVec3> {
        let weighted = |e: usize| value(e, self.outlines.of(e)) * self.areas[e];
        let weighted: Vec<DVec3> = (0..self.areas.len()).into_par_iter().map(weighted).collect();
        let mean = |v: u32| {
            let around = || self.around.at(v).iter().map(|&e| e as usize);
            let sum = around().map(|e| weighted[e]).sum::<DVec3>();
            sum / around().map(|e| self.areas[e]).sum::<f64>()
        };
        (0..self.around.vertex_count() as u32).into_par_iter().map(mean).collect()
    }
}

/// Radiosity at the vertices on boundaries of smooth surfaces, W/m² per channel, with the index of
/// each: a linear fit to the elements there. Vertices with too few elements, or all of them on a
/// line, keep what they have in `averaged`.
fn boundary_values(
    mesh: &Mesh,
    outlines: &ElementLoops,
    positions: &[DVec3],
    normals: &[DVec3],
    element_radiosity: &[Rgb],
    averaged: &[Rgb],
) -> Vec<(usize, Rgb)> {
    let boundary = boundary_fit::boundary_vertices(mesh, outlines, positions, normals);
    let values =
        boundary.iter().map(|b| (b.vertex, b.fitted(element_radiosity, averaged[b.vertex])));
    values.filter(|(_, value)| value.is_finite()).collect()
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use super::*;
    use crate::scene::{Material, Scene, Triangle};

    /// Triangles over shared positions; one group and one material each as given.
    fn mesh(positions: &[[f64; 3]], faces: &[([u32; 3], u32, u32)], size: f64) -> Mesh {
        let triangles = faces.iter().map(|&(corners, group, material)| Triangle {
            corners,
            group,
            material,
            smoothing: None,
        });
        let names = ["a", "b"].map(String::from).to_vec();
        let materials = ["a", "b"].map(|n| Material::grey(n, 0.5)).to_vec();
        let positions = positions.iter().map(|&p| DVec3::from_array(p)).collect();
        Mesh::new(Scene::new(positions, triangles.collect(), names, materials).unwrap(), size)
            .unwrap()
    }

    const SQUARE: [[f64; 3]; 4] = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]];

    /// Side of each face, as a pair of vertices, with how often it is run in each direction.
    fn sides(s: &VertexMesh) -> HashMap<(u32, u32), [u32; 2]> {
        let mut count: HashMap<(u32, u32), [u32; 2]> = HashMap::new();
        for f in &s.faces {
            for k in 0..3 {
                let (a, b) = (f[k], f[(k + 1) % 3]);
                count.entry((a.min(b), a.max(b))).or_default()[usize::from(a > b)] += 1;
            }
        }
        count
    }

    fn surface_area(s: &VertexMesh) -> f64 {
        let area = |f: &[u32; 3]| {
            let [a, b, c] = f.map(|v| s.positions[v as usize]);
            (b - a).cross(c - a).length() / 2.0
        };
        s.faces.iter().map(area).sum()
    }

    #[test]
    fn groups_and_materials_cut_the_diagonal() {
        let count = |second: (u32, u32)| {
            let faces = [([0, 1, 2], 0, 0), ([0, 2, 3], second.0, second.1)];
            let m = mesh(&SQUARE, &faces, 0.36);
            assert_eq!(m.element_count(), 2 * 16);
            VertexMesh::new(&m, &[Rgb::ONE; 32]).positions.len()
        };
        assert_eq!(count((0, 0)), 25);
        assert_eq!(count((1, 0)), 30);
        assert_eq!(count((0, 1)), 30);
    }

    #[test]
    fn crease_angle_decides_shared_normals() {
        for (degrees, vertices) in
            [(Mesh::CREASE_DEGREES - 1.0, 4), (Mesh::CREASE_DEGREES + 1.0, 6)]
        {
            let a = f64::to_radians(degrees);
            let points = [[0., 0., 0.], [0., 1., 0.], [-1., 0., 0.], [a.cos(), 0., a.sin()]];
            let m = mesh(&points, &[([0, 1, 2], 0, 0), ([1, 0, 3], 0, 0)], 9.0);
            assert_eq!(VertexMesh::new(&m, &[Rgb::ONE; 2]).positions.len(), vertices);
        }
    }

    #[test]
    fn unequal_neighbours_leave_no_crack() {
        // A long and a short triangle share a side: at size 0.5 they split 3 and 2 times.
        let points = [[0., 0., 0.], [1., 0., 0.], [0., 3., 0.], [1., 0.7, 0.]];
        let m = mesh(&points, &[([0, 3, 2], 0, 0), ([0, 1, 3], 0, 0)], 0.5);
        let depths = [0, 1].map(|t| m.depth(t));
        assert_ne!(depths[0], depths[1]);
        let values: Vec<Rgb> = (0..m.element_count()).map(|e| Rgb::splat(e as f64)).collect();
        let s = VertexMesh::new(&m, &values);
        let area: f64 = [0, 1].map(|t| m.scene().area(t)).iter().sum();
        assert!((surface_area(&s) - area).abs() < 1e-14, "covered once");
        // Inside, every side is run once each way; on the outline once. The outline's length is
        // that of the four outer sides: nothing opens up along the shared one.
        let mut outline = 0.0;
        for ((a, b), runs) in sides(&s) {
            match runs {
                [1, 1] => {}
                [1, 0] | [0, 1] => {
                    outline += s.positions[a as usize].distance(s.positions[b as usize]);
                }
                other => panic!("{other:?}"),
            }
        }
        let p = points.map(DVec3::from_array);
        let want = p[0].distance(p[1]) + p[1].distance(p[3]) + p[3].distance(p[2]) + 3.0;
        assert!((outline - want).abs() < 1e-14, "{outline} {want}");
    }

    #[test]
    fn fit_keeps_constants_and_slopes() {
        let faces = [([0, 1, 2], 0, 0), ([0, 2, 3], 0, 0)];
        let m = mesh(&SQUARE, &faces, 0.1);
        let constant = vec![Rgb::new(1., 2., 3.); m.element_count()];
        let s = VertexMesh::new(&m, &constant);
        assert!(s.radiosity.iter().all(|b| b.distance(Rgb::new(1., 2., 3.)) < 1e-13));
        let at_centroids = |f: &dyn Fn(DVec3) -> f64| -> Vec<Rgb> {
            let nodes = (0..m.element_count()).map(|e| m.element(e));
            nodes.map(|n| Rgb::splat(f(m.centroid(n)))).collect()
        };
        // Means of a linear function are exact inside, and linear fits at the boundary.
        let s = VertexMesh::new(&m, &at_centroids(&|p| 0.3 + p.x - 0.2 * p.y));
        for (p, b) in s.positions.iter().zip(&s.radiosity) {
            assert!((b.x - (0.3 + p.x - 0.2 * p.y)).abs() < 1e-12, "{p} {}", b.x);
        }
        // A step down to nothing would be overshot; it is not.
        let s = VertexMesh::new(&m, &at_centroids(&|p| f64::from(p.x > 0.1)));
        assert!(s.radiosity.iter().all(|b| b.min_element() >= 0.0));
    }

    #[test]
    fn per_element_keeps_element_values() {
        let m = mesh(&SQUARE, &[([0, 1, 2], 0, 0), ([0, 2, 3], 0, 0)], 0.8);
        let values: Vec<Rgb> = (0..m.element_count()).map(|e| Rgb::splat(e as f64)).collect();
        let s = VertexMesh::per_element(&m, &values);
        assert_eq!(s.positions.len(), 3 * m.element_count());
        assert!((surface_area(&s) - 1.0).abs() < 1e-15);
        for (face, &e) in s.faces.iter().zip(&s.elements) {
            assert!(face.iter().all(|&v| s.radiosity[v as usize].x == f64::from(e)));
        }
    }
}
