//! Elements to vertices: a triangle mesh that carries radiosity, ready to be shown or exported.

mod boundary_fit;
mod corner_singularity;
pub(crate) mod hanging_nodes;
pub(crate) mod keys;

use glam::DVec3;

use crate::mesh::{Mesh, SurfaceTopology};
use crate::scene::Rgb;
use hanging_nodes::HangingNodes;
use keys::Vertices;

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
    /// Radiosity B at the vertices, W/m² per channel, linear.
    pub radiosity: Vec<Rgb>,
    /// How far the radiosity of each vertex and of the faces around it may be off, one standard error,
    /// W/m²: a length over the channels. Empty where nothing is known of it.
    pub error: Vec<f64>,
    /// Faces, counter-clockwise from the front, as indices of vertices.
    pub faces: Vec<[u32; 3]>,
    /// The element that each face is (a part of).
    pub elements: Vec<u32>,
    /// What a reader of the file should know, one line each.
    pub comments: Vec<String>,
}

impl VertexMesh {
    /// Radiosity at the vertices of `mesh` from that of its elements, one value an element.
    ///
    /// First the area-weighted mean of the elements around each vertex (Cohen and Greenberg 1985),
    /// at the boundary of a smooth surface a linear fit to them instead, with what is known not to
    /// be linear kept out of it: light from surfaces that meet this one there. That smooths: the
    /// mean over an element's corners is no longer the element's value. One step of van Cittert's
    /// (1931) iteration gives most of it back, by adding the area-weighted mean of the differences.
    /// No value is let below zero.
    pub fn new(mesh: &Mesh, element_radiosity: &[Rgb]) -> VertexMesh {
        VertexMesh::with_corners(mesh, element_radiosity).0
    }

    /// The same, and the vertices at the corners of each element.
    pub(crate) fn with_corners(
        mesh: &Mesh,
        element_radiosity: &[Rgb],
    ) -> (VertexMesh, Vec<[u32; 3]>) {
        let smooth = SurfaceTopology::new(mesh.scene());
        let vertices = Vertices::new(mesh, &smooth);
        let (positions, rims) = (&vertices.positions, &vertices.outlines);
        let areas: Vec<f64> = rims.iter().map(|(e, _)| mesh.area(mesh.element(e))).collect();
        let mut around = vec![0.0; positions.len()];
        rims.iter().for_each(|(e, rim)| rim.iter().for_each(|&v| around[v as usize] += areas[e]));
        let mean = |value: &dyn Fn(usize, &[u32]) -> DVec3| {
            let mut sums = vec![DVec3::ZERO; positions.len()];
            for (e, rim) in rims.iter() {
                let weighted = value(e, rim) * areas[e];
                rim.iter().for_each(|&v| sums[v as usize] += weighted);
            }
            sums.into_iter().zip(&around).map(|(sum, area)| sum / area).collect::<Vec<_>>()
        };
        let normals = mean(&|e, _| mesh.normal(mesh.element(e)));
        let mut smoothed = mean(&|e, _| element_radiosity[e]);
        let normals: Vec<DVec3> = normals.into_iter().map(DVec3::normalize_or_zero).collect();
        boundary_fit::extrapolate(
            mesh,
            rims,
            positions,
            &normals,
            element_radiosity,
            &mut smoothed,
        );
        let missing = mean(&|e, rim| {
            let corners = rim.iter().map(|&v| smoothed[v as usize]).sum::<Rgb>();
            element_radiosity[e] - corners / rim.len() as f64
        });
        let corrected = smoothed.iter().zip(missing).map(|(&b, m)| (b + m).max(Rgb::ZERO));
        let mut out = VertexMesh {
            radiosity: corrected.collect(),
            normals,
            positions: positions.clone(),
            ..Default::default()
        };
        out.add_elements(mesh, &HangingNodes::new(mesh, &smooth, &vertices), |_, e| {
            element_radiosity[e]
        });
        (out, vertices.corners)
    }

    /// Adds every element of `mesh` as a face, or as a fan where there are vertices on its sides;
    /// `middle` says what the fan has in its middle, W/m².
    pub(crate) fn add_elements(
        &mut self,
        mesh: &Mesh,
        seams: &HangingNodes,
        middle: impl Fn(&Self, usize) -> Rgb,
    ) {
        for seam in &seams.vertices {
            let [a, b] = seam.between.map(|v| v as usize);
            self.positions.push(seam.position);
            self.normals.push((self.normals[a] + self.normals[b]).normalize_or_zero());
            self.radiosity.push((self.radiosity[a] + self.radiosity[b]) / 2.0);
        }
        for (e, rim) in seams.rims.iter() {
            match *rim {
                [a, b, c] => self.add_face([a, b, c], e),
                _ => self.add_fan(mesh, rim, e, middle(self, e)),
            }
        }
    }

    fn add_face(&mut self, face: [u32; 3], e: usize) {
        self.faces.push(face);
        self.elements.push(e as u32);
    }

    /// Adds element `e` as a fan around its centroid.
    fn add_fan(&mut self, mesh: &Mesh, rim: &[u32], e: usize, radiosity: Rgb) {
        let centre = self.positions.len() as u32;
        self.positions.push(mesh.centroid(mesh.element(e)));
        self.normals.push(mesh.normal(mesh.element(e)));
        self.radiosity.push(radiosity);
        for (k, &a) in rim.iter().enumerate() {
            self.add_face([centre, a, rim[(k + 1) % rim.len()]], e);
        }
    }

    /// The same mesh with each element's own value at all its corners: what the solver found,
    /// nothing averaged. `element_radiosity` holds one value an element.
    pub fn per_element(mesh: &Mesh, element_radiosity: &[Rgb]) -> VertexMesh {
        let mut out = VertexMesh::default();
        for (e, &radiosity) in element_radiosity.iter().enumerate().take(mesh.element_count()) {
            let node = mesh.element(e);
            let first = out.positions.len() as u32;
            out.positions.extend(mesh.corners(node));
            out.normals.extend([mesh.normal(node); 3]);
            out.radiosity.extend([radiosity; 3]);
            out.faces.push([first, first + 1, first + 2]);
            out.elements.push(e as u32);
        }
        out
    }
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
    fn flat_keeps_every_element_its_own_value() {
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
