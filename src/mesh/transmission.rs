//! Transport of light through translucent elements.
//!
//! The two sides of a translucent surface are separate triangles, coincident and back to back
//! ([`Scene::other_side`](crate::Scene)). Each is cut into elements by itself, so that light
//! arriving at one element leaves from all elements behind it, in proportion to the shared area:
//!
//! ```text
//!      ●──────── e ────────●        of the light received by e, f emits     τ · |e ∩ f| / |e|
//!      ┊     │             ┊        of the light received by f, e emits     τ · |e ∩ f| / |f|
//!      ●─ f ─●────── g ────●
//! ```

use glam::DVec3;

use super::{Mesh, NodeId};
use crate::geometry::COINCIDENCE_TOLERANCE;
use crate::geometry::polygon::{clip, polygon_area};
use crate::scene::{Material, Rgb};

/// Light passed on between elements and those behind them; empty if nothing is translucent.
#[derive(Clone, Debug, Default)]
pub(crate) struct Transmission {
    /// Those of element e are from `first[e]` to `first[e + 1]`.
    first: Vec<u32>,
    passages: Vec<Passage>,
    /// Per element, the fraction of its received light that it passes on to all of them.
    passed: Vec<Rgb>,
}

/// Between an element and one behind it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Passage {
    /// The one behind it.
    pub behind: u32,
    /// Fraction per channel of the light received by the element that leaves from the one behind.
    pub passed: Rgb,
    /// Fraction per channel of the light received by the one behind that leaves from the element.
    pub returned: Rgb,
}

impl Transmission {
    /// For the elements of `mesh`.
    pub fn new(mesh: &Mesh) -> Transmission {
        let scene = mesh.scene();
        if !scene.materials().iter().any(Material::is_translucent) {
            return Transmission::default();
        }
        let mut all = Transmission { first: vec![0], ..Default::default() };
        for e in 0..mesh.element_count() {
            let node = mesh.element(e);
            let mut passed = Rgb::ZERO;
            for s in scene.other_side(mesh.triangle(node)) {
                for (behind, area) in overlaps(mesh, node, mesh.root(s)) {
                    let passage = Passage {
                        behind: behind as u32,
                        passed: mesh.transmittance(behind) * (area / mesh.solid_area(node)),
                        returned: mesh.transmittance(e)
                            * (area / mesh.solid_area(mesh.element(behind))),
                    };
                    passed += passage.passed;
                    all.passages.push(passage);
                }
            }
            all.passed.push(passed);
            all.first.push(all.passages.len() as u32);
        }
        all
    }

    /// Whether nothing is translucent.
    pub fn is_none(&self) -> bool {
        self.passages.is_empty()
    }

    /// The elements behind element `e`.
    pub fn behind(&self, e: usize) -> &[Passage] {
        if self.is_none() {
            return &[];
        }
        &self.passages[self.first[e] as usize..self.first[e + 1] as usize]
    }

    /// Fraction per channel of the light received by element `e` that leaves from those behind it.
    pub fn passed(&self, e: usize) -> Rgb {
        self.passed.get(e).copied().unwrap_or(Rgb::ZERO)
    }

    /// Light leaving element `e` that those behind it receive, given the flux `incident` on each
    /// element.
    pub fn transmitted(&self, e: usize, incident: &[Rgb]) -> Rgb {
        let part = |p: &Passage| p.returned * incident[p.behind as usize];
        self.behind(e).iter().map(part).sum()
    }
}

/// Elements below `other` that share area with `node`, in one plane, and that area without holes.
fn overlaps(mesh: &Mesh, node: NodeId, other: NodeId) -> Vec<(usize, f64)> {
    let (mut open, mut facing) = (vec![other], vec![]);
    while let Some(other) = open.pop() {
        let min_area = COINCIDENCE_TOLERANCE * mesh.area(node).min(mesh.area(other));
        let shared = shared_polygon(mesh, node, other);
        let area = polygon_area(&shared);
        if area <= min_area {
            continue;
        }
        match mesh.children(other) {
            Some(children) => open.extend(children.into_iter().rev()),
            None => match solid_share(mesh, node, &shared) * area {
                area if area <= min_area => {}
                area => facing.push((mesh.elements_of(other).start, area)),
            },
        }
    }
    facing
}

/// The intersection of two nodes in one plane.
fn shared_polygon(mesh: &Mesh, node: NodeId, other: NodeId) -> Vec<DVec3> {
    let (corners, normal) = (mesh.corners(node), mesh.normal(node));
    let mut shared: Vec<DVec3> = mesh.corners(other).to_vec();
    for k in 0..3 {
        let (a, b) = (corners[k], corners[(k + 1) % 3]);
        shared = clip(&shared, a, normal.cross(b - a).normalize_or_zero());
    }
    shared
}

/// The fraction of a convex polygon on `node` outside of holes.
fn solid_share(mesh: &Mesh, node: NodeId, polygon: &[DVec3]) -> f64 {
    let (scene, t) = (mesh.scene(), mesh.triangle(node));
    let [first, rest @ ..] = polygon else { return 1.0 };
    if mesh.solid_share(node) == 1.0 {
        return 1.0;
    }
    let (mut solid, mut all) = (0.0, 0.0);
    for edge in rest.windows(2) {
        let part = [*first, edge[0], edge[1]];
        let area = polygon_area(&part);
        solid += area * scene.solid_share((t, part.map(|p| scene.barycentric(t, p))));
        all += area;
    }
    if all > 0.0 { solid / all } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::scene::{Scene, Sides, Triangle};

    /// A square of translucent triangles with its second side added, each split the number of times
    /// in `levels`.
    fn sheet(levels: [u32; 4]) -> Mesh {
        let positions = [[0.1, 0.0], [2.3, 0.2], [2.0, 1.9], [0.0, 1.4]]
            .map(|[x, y]| x * DVec3::new(0.6, 0.0, 0.8) + y * DVec3::Y);
        let triangle = |corners| Triangle { corners, ..Default::default() };
        let triangles = vec![triangle([0, 1, 2]), triangle([0, 2, 3])];
        let transmittance = Rgb::new(0.5, 0.25, 0.0);
        let leaf = Material { transmittance, sides: Sides::Both, ..Material::grey("leaf", 0.25) };
        let groups = vec!["leaf".into()];
        let scene = Scene::new(positions.to_vec(), triangles, groups, vec![leaf]).unwrap();
        let scene = Arc::new(scene.resolve_sides());
        assert_eq!(scene.triangles().len(), 4);
        let mut mesh = Mesh::new(scene, f64::INFINITY).unwrap();
        for level in 0..3 {
            let coarse = |e: &usize| {
                let node = mesh.element(*e);
                levels[mesh.triangle(node)] > level
            };
            let elements: Vec<usize> = (0..mesh.element_count()).filter(coarse).collect();
            mesh = mesh.split(&elements).unwrap();
        }
        mesh
    }

    #[test]
    fn all_that_arrives_on_one_side_leaves_from_the_other() {
        for levels in [[0; 4], [2, 1, 2, 1], [3, 0, 0, 2], [0, 3, 1, 0]] {
            let mesh = sheet(levels);
            let transmission = Transmission::new(&mesh);
            let count = mesh.element_count();
            for e in 0..count {
                // Sums over a few polygons with rounding of a few 1e-16 each; slivers of 1e-9.
                let passed = transmission.passed(e);
                assert!(passed.abs_diff_eq(Rgb::new(0.5, 0.25, 0.0), 1e-8), "{levels:?} {passed}");
                let normal = mesh.normal(mesh.element(e));
                for p in transmission.behind(e) {
                    assert!(normal.dot(mesh.normal(mesh.element(p.behind as usize))) < -0.999);
                }
            }
            // Pushing to and pulling from behind give the same.
            let incident: Vec<Rgb> = (0..count).map(|e| Rgb::splat(1.0 + e as f64)).collect();
            let mut pushed = vec![Rgb::ZERO; count];
            for (e, &arrives) in incident.iter().enumerate() {
                for p in transmission.behind(e) {
                    pushed[p.behind as usize] += p.passed * arrives;
                }
            }
            for (e, pushed) in pushed.into_iter().enumerate() {
                let pulled = transmission.transmitted(e, &incident);
                assert!(pulled.abs_diff_eq(pushed, 1e-9 * incident[count - 1].x));
            }
        }
    }

    #[test]
    fn what_is_opaque_passes_nothing_on() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell_box.obj");
        let mesh = Mesh::new(crate::load_scene(path).unwrap(), 300.0).unwrap();
        let transmission = Transmission::new(&mesh);
        assert!(transmission.is_none() && transmission.behind(3).is_empty());
        assert_eq!(transmission.passed(3), Rgb::ZERO);
    }
}
