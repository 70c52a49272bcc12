//! Glass triangles that enclose bodies, and those that are panes.
//!
//! ```text
//!     ┌──────────┐  body: each side of its triangles     ─────────  pane: a sheet with an end;
//!     │  glass   │  is shared by one other of them                  light goes straight on
//!     │  ┌────┐  │
//!     │  │ air│  │  cavity: a body in a body, with opposite winding
//!     │  └────┘  │
//!     └──────────┘  Another body in it, with equal winding, has its own glass.
//! ```
//!
//! The outside follows from the shape, not from the winding of triangles: files have bodies inside
//! out. The winding of a body matters only relative to that of one around it.

use std::f64::consts::TAU;

use glam::DVec3;
use rustc_hash::FxHashMap;

use super::clear_panes::ClearPanes;
use super::{Material, Rgb, Scene, Specular};
use crate::geometry::aabb::Aabb;
use crate::geometry::union_find::UnionFind;
use crate::geometry::weld::Weld;

/// Role of a triangle of glass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum GlassFace {
    /// A part of a sheet.
    Pane,
    /// A part of the boundary of a body.
    Boundary {
        /// Index of the body.
        body: u32,
        /// Whether its front looks out of the glass.
        front_is_outside: bool,
    },
}

/// A medium around a point: a body, and its refractive index.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Medium {
    pub body: u32,
    pub refractive_index: f64,
}

/// The glass of a scene.
pub(crate) struct GlassBodies {
    /// Per triangle of the scene; none if it is not glass.
    pub faces: Vec<Option<GlassFace>>,
    /// Per triangle, whether an earlier one has its corners and material.
    is_copy: Vec<bool>,
    /// Per triangle, whether it is in a closed surface of no volume: a duplicated sheet with other
    /// diagonals.
    is_layer: Vec<bool>,
    shells: Vec<Shell>,
}

/// A closed surface.
struct Shell {
    material: u32,
    /// Corners counter-clockwise seen from outside, scene unit.
    triangles: Vec<[DVec3; 3]>,
    bounds: Aabb,
    /// Scene unit cubed, above 0.
    volume: f64,
    /// Area of the triangles that face out of it, less that of the others.
    outward_area: f64,
    /// The body that it bounds.
    body: u32,
    /// Whether the glass is around it.
    is_cavity: bool,
}

/// A triangle of glass by its corners' numbers.
#[derive(Clone, Copy)]
struct Face {
    triangle: usize,
    corners: [u32; 3],
}

impl GlassBodies {
    pub fn new(scene: &Scene) -> GlassBodies {
        let (all, unique) = glass_faces(scene);
        let count = scene.triangles().len();
        let mut bodies = GlassBodies {
            faces: vec![None; count],
            is_copy: vec![false; count],
            is_layer: vec![false; count],
            shells: vec![],
        };
        // The shell of each of the unique faces, and whether it faces out of that.
        let mut of_faces: Vec<Option<(usize, bool)>> = vec![None; unique.len()];
        for (members, outward) in shells(scene, &unique) {
            let Some((shell, flipped)) = Shell::new(scene, &unique, &members, &outward) else {
                members.iter().for_each(|&k| bodies.is_layer[unique[k].triangle] = true);
                continue;
            };
            for (&k, outward) in members.iter().zip(outward) {
                of_faces[k] = Some((bodies.shells.len(), outward != flipped));
            }
            bodies.shells.push(shell);
        }
        bodies.nest();
        for (Face { triangle: t, corners }, number) in all {
            let face = of_faces[number].map(|(shell, outward)| {
                let Shell { body, is_cavity, .. } = bodies.shells[shell];
                let alike = same_way_round(corners, unique[number].corners);
                GlassFace::Boundary { body, front_is_outside: (outward == alike) != is_cavity }
            });
            bodies.faces[t] = Some(face.unwrap_or(GlassFace::Pane));
            bodies.is_copy[t] = unique[number].triangle != t;
        }
        bodies
    }

    /// Fraction of the way through a pane or a body per crossing of triangle `t`: 1 for a pane, 1/2
    /// at the surface of a body, 0 for a copy of another triangle.
    pub fn crossing(&self, t: usize) -> f64 {
        match self.faces[t] {
            _ if self.is_copy[t] => 0.0,
            Some(GlassFace::Boundary { .. }) => 0.5,
            Some(GlassFace::Pane) if self.is_layer[t] => 0.5,
            Some(GlassFace::Pane) => 1.0,
            None => 0.0,
        }
    }

    /// The bodies around `point`, the innermost last.
    pub fn around(&self, scene: &Scene, point: DVec3) -> Vec<Medium> {
        let mut around: Vec<&Shell> = self.shells.iter().filter(|s| s.encloses(point)).collect();
        around.sort_by(|a, b| b.volume.total_cmp(&a.volume));
        let mut media: Vec<Medium> = vec![];
        for shell in around {
            if shell.is_cavity {
                media.retain(|medium| medium.body != shell.body);
            } else if let Some(Specular::Glass { refractive_index, .. }) =
                scene.materials()[shell.material as usize].specular
            {
                media.push(Medium { body: shell.body, refractive_index });
            }
        }
        media
    }

    /// Determines the cavities, and numbers bodies by the shells around them.
    fn nest(&mut self) {
        let shells = &self.shells;
        let position = |s: &Shell| s.triangles[0][0];
        let around = |k: usize| -> Vec<usize> {
            let encloses = |&j: &usize| {
                j != k
                    && shells[j].material == shells[k].material
                    && shells[j].volume > shells[k].volume
                    && shells[j].encloses(position(&shells[k]))
            };
            (0..shells.len()).filter(encloses).collect()
        };
        let around: Vec<Vec<usize>> = (0..shells.len()).map(around).collect();
        let by_volume = |a: &usize, b: &usize| shells[*a].volume.total_cmp(&shells[*b].volume);
        let faces_out = |k: usize| shells[k].outward_area > 0.0;
        let is_cavity = |k: usize| {
            let outermost = around[k].iter().copied().max_by(by_volume);
            outermost.is_some_and(|outermost| faces_out(outermost) != faces_out(k))
        };
        let is_cavity: Vec<bool> = (0..shells.len()).map(is_cavity).collect();
        let host = |k: usize| {
            let solid = around[k].iter().copied().filter(|&j| !is_cavity[j]);
            solid.min_by(by_volume).filter(|_| is_cavity[k]).unwrap_or(k)
        };
        let hosts: Vec<usize> = (0..shells.len()).map(host).collect();
        for (k, shell) in self.shells.iter_mut().enumerate() {
            (shell.body, shell.is_cavity) = (hosts[k] as u32, is_cavity[k]);
        }
    }
}

impl Shell {
    /// The shell of these faces, of which those not `alike` have the opposite winding. Also whether
    /// those alike face into it. None if it is flat.
    fn new(
        scene: &Scene,
        faces: &[Face],
        members: &[usize],
        alike: &[bool],
    ) -> Option<(Shell, bool)> {
        let corners = |(&k, &alike): (&usize, &bool)| {
            let [a, b, c] = scene.corners(faces[k].triangle);
            if alike { [a, b, c] } else { [a, c, b] }
        };
        let mut triangles: Vec<[DVec3; 3]> = members.iter().zip(alike).map(corners).collect();
        let origin = triangles[0][0];
        let cone = |[a, b, c]: &[DVec3; 3]| (a - origin).cross(b - origin).dot(c - origin) / 6.0;
        let volume: f64 = triangles.iter().map(cone).sum();
        let areas = || members.iter().map(|&k| scene.area(faces[k].triangle));
        let area: f64 = areas().sum();
        // A duplicated sheet; a ball has 0.094, a plate with a thickness of 10⁻⁶ of its width some
        // 10⁻⁷.
        if volume.is_nan() || volume.abs() <= 1e-9 * libm::pow(area, 1.5) {
            return None;
        }
        let flipped = volume < 0.0;
        if flipped {
            triangles.iter_mut().for_each(|corners| corners.swap(1, 2));
        }
        let signed = areas().zip(alike).map(|(a, &alike)| if alike != flipped { a } else { -a });
        let shell = Shell {
            material: scene.triangles()[faces[members[0]].triangle].material,
            bounds: Aabb::from_points(triangles.iter().flatten().copied()),
            triangles,
            volume: volume.abs(),
            outward_area: signed.sum(),
            body: 0,
            is_cavity: false,
        };
        Some((shell, flipped))
    }

    /// Whether `point` is inside, by the solid angle of the shell from it.
    fn encloses(&self, point: DVec3) -> bool {
        let Aabb { low, high } = self.bounds;
        let is_near = point.cmpge(low).all() && point.cmple(high).all();
        is_near && self.triangles.iter().map(|t| solid_angle(*t, point)).sum::<f64>() > TAU
    }
}

/// All triangles of glass, each with the number of the first that has its corners and material; and
/// these.
fn glass_faces(scene: &Scene) -> (Vec<(Face, usize)>, Vec<Face>) {
    let is_glass = |&t: &usize| scene.material(t).specular.is_some_and(|s| s.is_glass());
    let mut weld = Weld::default();
    let (mut unique, mut numbers) = (vec![], FxHashMap::default());
    let face = |triangle: usize| {
        let corners = scene.corners(triangle).map(|p| weld.number(p));
        let mut key = corners;
        key.sort_unstable();
        let face = Face { triangle, corners };
        let number = numbers.entry((scene.triangles()[triangle].material, key));
        let number = *number.or_insert_with(|| {
            unique.push(face);
            unique.len() - 1
        });
        (face, number)
    };
    let all = (0..scene.triangles().len()).filter(is_glass).map(face).collect();
    (all, unique)
}

/// The closed surfaces of `faces`: the members of each, and which of them have equal winding.
fn shells(scene: &Scene, faces: &[Face]) -> Vec<(Vec<usize>, Vec<bool>)> {
    let edges = |k: usize| {
        let ([a, b, c], material) =
            (faces[k].corners, scene.triangles()[faces[k].triangle].material);
        [(a, b), (b, c), (c, a)].map(|(a, b)| ((material, a.min(b), a.max(b)), a < b))
    };
    let mut sharing: FxHashMap<(u32, u32, u32), Vec<usize>> = FxHashMap::default();
    for k in 0..faces.len() {
        edges(k).into_iter().for_each(|(edge, _)| sharing.entry(edge).or_default().push(k));
    }
    let mut sets = UnionFind::new(faces.len());
    for pair in sharing.values() {
        // If more share an edge, those of one body are joined across other edges.
        if let [a, b] = pair[..] {
            sets.join(a, b);
        }
    }
    let sets: Vec<usize> = (0..faces.len()).map(|k| sets.find(k)).collect();
    let neighbour = |k: usize, edge| {
        let mut others = sharing[&edge].iter().filter(|&&j| j != k && sets[j] == sets[k]);
        others.next().filter(|_| others.next().is_none()).copied()
    };
    let mut members: Vec<Vec<usize>> = vec![vec![]; faces.len()];
    (0..faces.len()).for_each(|k| members[sets[k]].push(k));
    let mut alike: Vec<Option<bool>> = vec![None; faces.len()];
    let mut closed = vec![];
    'sets: for members in members.into_iter().filter(|members| !members.is_empty()) {
        alike[members[0]] = Some(true);
        let mut queue = vec![members[0]];
        while let Some(k) = queue.pop() {
            for (edge, forward) in edges(k) {
                let Some(other) = neighbour(k, edge) else { continue 'sets };
                // With equal winding, they run along their side in opposite directions.
                let runs_forward = edges(other).contains(&(edge, true));
                let wanted = alike[k].map(|alike| alike == (forward != runs_forward));
                match alike[other] {
                    None => queue.push(other),
                    // A one-sided band encloses nothing.
                    known if known != wanted => continue 'sets,
                    _ => {}
                }
                alike[other] = wanted;
            }
        }
        let of_members = members.iter().map(|&k| alike[k]).collect::<Option<Vec<bool>>>();
        closed.extend(of_members.map(|alike| (members, alike)));
    }
    closed
}

/// Whether the same three corners are in the same cyclic order.
fn same_way_round(a: [u32; 3], b: [u32; 3]) -> bool {
    (0..3).any(|k| [0, 1, 2].map(|i| a[(i + k) % 3]) == b)
}

/// Solid angle of a triangle from `point`, above 0 if its back is seen (van Oosterom and Strackee
/// 1983, equation 8).
fn solid_angle(corners: [DVec3; 3], point: DVec3) -> f64 {
    let [a, b, c] = corners.map(|corner| corner - point);
    let [x, y, z] = [a.length(), b.length(), c.length()];
    let below = x * y * z + a.dot(b) * z + b.dot(c) * x + c.dot(a) * y;
    2.0 * libm::atan2(a.dot(b.cross(c)), below)
}

/// The clear panes and bodies of `scene`; none if it has none.
pub(super) fn clear_panes(scene: &Scene) -> Option<ClearPanes> {
    let of_material: Vec<Option<Rgb>> =
        scene.materials().iter().map(Material::clear_transmittance).collect();
    let of = |t: usize| of_material[scene.triangles()[t].material as usize];
    let count = scene.triangles().len();
    if !(0..count).any(|t| of(t).is_some()) {
        return None;
    }
    let glass = GlassBodies::new(scene);
    let transmittance = |t: usize| Some(of(t)?.map(|share| libm::pow(share, glass.crossing(t))));
    Some(ClearPanes { transmittance: (0..count).map(transmittance).collect() })
}
