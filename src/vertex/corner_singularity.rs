//! Values where surfaces meet in an edge or corner: the singularity of their exchange.
//!
//! Let the radiosity of a wall rise by b per length from its edge with a floor. At distance d from
//! that edge the floor receives ∫ b h dF from it, up to a height H: (b d / 2)(ln(2H/d) − 1) for
//! d ≪ H, since F = (1 − d/√(d² + h²)) / 2 of what is lower than h. That is infinitely steep at the
//! edge (K. E. Atkinson, "The planar radiosity equation and its numerical solution", IMA J. Numer.
//! Anal. 20, 2000, on such corners), so a line through the floor's elements ends too high there, or
//! too low if b < 0.
//!
//! ```text
//!   wall │               B of the floor = smooth part + ρ ∫ (B_wall − B_wall(edge)) dF
//!        │                                              └ singular, but 0 at the edge itself
//!        │ b
//!        └────────       fit(B) − fit(singular part), which extrapolates the smooth part alone
//!        edge  floor
//! ```
//!
//! The singular part is known from the wall's elements, so it is subtracted from the fit of
//! [`boundary_fit`](super::boundary_fit). With a constant wall it is zero, and constants stay what
//! they are. B_wall(edge) is itself a value to be corrected, so this is a fixed-point iteration
//! over the vertices at one position.
//!
//! Only vertices at one position take part, with the few elements around them; occlusion between
//! those is ignored.

use std::collections::HashMap;

use rayon::prelude::*;

use super::boundary_fit::BoundaryVertex;
use crate::form_factor::closed_form::point_to_polygon;
use crate::mesh::{Mesh, NodeId};
use crate::scene::Rgb;

/// Vertices in one cell of a grid this fine, a share of the scene's longest extent, are at one
/// position. A power of two, so that positions at binary fractions of the extent lie in the middle
/// of a cell, not where rounding decides.
const COINCIDENCE_CELL: f64 = 1.0 / (1 << 20) as f64;

/// Where more vertices are at one position, none is corrected: time and memory are quadratic in
/// their number. Three meet in the corner of a room; this many mean a scene that is small within
/// its extent. Chosen by hand.
const MAX_COINCIDENT: usize = 256;

/// Steps of the fixed-point iteration. Each passes on at most ρ F of the remaining error, with
/// F = ½ between perpendicular walls: ½⁵ = 3 % remains.
const ITERATIONS: usize = 5;

/// Elements of a shooting patch where surfaces meet, about. With 16 the edges of the Cornell box in
/// elements of 30 mm come out better than with 4 or 64.
const PATCH_ELEMENTS: usize = 16;

/// What a boundary vertex receives from the surface of another one at its position, W/m² per
/// channel: `gain` times the radiosity at that vertex, less `received`.
struct EdgeExchange {
    /// Index of the other boundary vertex.
    other: usize,
    /// ρ times the form factor to the other's elements, extrapolated by the fit.
    gain: Rgb,
    /// ρ times the irradiance from them, extrapolated by the fit, W/m².
    received: Rgb,
}

/// The radiosity of all `boundary` vertices, W/m² per channel, from what was `fitted` to their
/// `elements`: with the singular part of what they receive from each other taken out. None is below
/// zero.
pub(super) fn correct_corner_exchange(
    mesh: &Mesh,
    boundary: &[BoundaryVertex],
    elements: &[Rgb],
    fitted: &[Rgb],
) -> Vec<Rgb> {
    let coincident = coincident_vertices(mesh, boundary);
    let shot = shot_radiosity(mesh, elements);
    let exchanges: Vec<Vec<EdgeExchange>> = (0..boundary.len())
        .into_par_iter()
        .map(|k| edge_exchanges(mesh, boundary, k, &coincident[k], &shot))
        .collect();
    let mut values: Vec<Rgb> = fitted.iter().map(|b| b.max(Rgb::ZERO)).collect();
    for _ in 0..ITERATIONS {
        let value = |(&fitted, exchanges): (&Rgb, &Vec<EdgeExchange>)| {
            let corrections = exchanges.iter().map(|x| x.gain * values[x.other] - x.received);
            (fitted + corrections.sum::<Rgb>()).max(Rgb::ZERO)
        };
        values = fitted.iter().zip(&exchanges).map(value).collect();
    }
    values
}

/// For each of the `boundary` vertices the others at its position, unless they are too many.
fn coincident_vertices(mesh: &Mesh, boundary: &[BoundaryVertex]) -> Vec<Vec<usize>> {
    let bounds = mesh.scene().bounds();
    let unit = bounds.longest_side() * COINCIDENCE_CELL;
    let cell =
        |vertex: &BoundaryVertex| ((vertex.position - bounds.low) / unit).round().as_i64vec3();
    let mut cells: HashMap<_, Vec<usize>> = HashMap::new();
    for (k, vertex) in boundary.iter().enumerate() {
        cells.entry(cell(vertex)).or_default().push(k);
    }
    let others = |(k, vertex)| {
        let here = &cells[&cell(vertex)];
        if here.len() > MAX_COINCIDENT {
            return vec![];
        }
        here.iter().copied().filter(|&m| m != k).collect()
    };
    boundary.iter().enumerate().map(others).collect()
}

/// Radiosity as the solver shot it: patches send the mean of their elements. The elements' values
/// came about by this, so only this can be taken out of them again. Emitters shoot as elements;
/// other patches are small where surfaces meet, and taken for [`PATCH_ELEMENTS`].
fn shot_radiosity(mesh: &Mesh, elements: &[Rgb]) -> Vec<Rgb> {
    let mut shot = elements.to_vec();
    for t in 0..mesh.scene().triangles().len() {
        if mesh.scene().exitance(t) == Rgb::ZERO {
            average_over_patches(mesh, mesh.root(t), &mut shot);
        }
    }
    shot
}

/// Gives all elements of each patch below `node` their mean.
fn average_over_patches(mesh: &Mesh, node: NodeId, values: &mut [Rgb]) {
    let elements = mesh.elements_of(node);
    match mesh.children(node) {
        Some(children) if elements.len() > PATCH_ELEMENTS => {
            for &child in &children {
                average_over_patches(mesh, child, values);
            }
        }
        _ => {
            let count = elements.len() as f64;
            let mean = values[elements.clone()].iter().sum::<Rgb>() / count;
            values[elements].fill(mean);
        }
    }
}

/// What boundary vertex `k` receives from the surfaces of the `others` at its position, of which
/// each element has the radiosity `shot`.
fn edge_exchanges(
    mesh: &Mesh,
    boundary: &[BoundaryVertex],
    k: usize,
    others: &[usize],
    shot: &[Rgb],
) -> Vec<EdgeExchange> {
    let Some(&(first, _)) = boundary[k].fit.first() else { return vec![] };
    let reflectance = mesh.material(mesh.element(first as usize)).reflectance;
    // The fit's value at the vertex, of form factors from the elements that it goes through.
    let fitted_factor = |j: u32| -> f64 {
        let polygon = mesh.corners(mesh.element(j as usize));
        let factor = |&(e, weight): &(u32, f64)| {
            let node = mesh.element(e as usize);
            weight * point_to_polygon(mesh.centroid(node), mesh.normal(node), &polygon)
        };
        boundary[k].fit.iter().map(factor).sum()
    };
    let mut total = 0.0;
    let mut exchanges = vec![];
    for &other in others {
        let mut gain = Rgb::ZERO;
        let mut received = Rgb::ZERO;
        for &j in &boundary[other].neighbourhood {
            let factor = fitted_factor(j);
            let relative = mesh.relative_reflectance(j as usize);
            total += factor.abs();
            gain += relative * factor;
            received += shot[j as usize] * relative * factor;
        }
        exchanges.push(EdgeExchange {
            other,
            gain: reflectance * gain,
            received: reflectance * received,
        });
    }
    // Extrapolated form factors can be too large, of either sign: together they are at most 1.
    let scale = 1.0 / f64::max(total, 1.0);
    for exchange in &mut exchanges {
        exchange.gain *= scale;
        exchange.received *= scale;
    }
    exchanges
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::boundary_fit::boundary_vertices;
    use super::super::boundary_values;
    use super::super::keys::{ElementLoops, Vertices};
    use super::*;
    use crate::mesh::SurfaceTopology;
    use crate::scene::{Material, Scene, Triangle};

    const SIDE: f64 = 1.0 / 16.0;

    /// Floor z = 0 and wall x = 0 of two units along their edge, one high or wide, facing each
    /// other; each a group. The wall has positions of its own, off by what rounding does.
    fn corner(floor_reflectance: f64) -> Mesh {
        let a = 1.0 + f64::EPSILON;
        let floor = [[0., 0., 0.], [1., 0., 0.], [1., 2., 0.], [0., 2., 0.]];
        let wall = [[0., 0., 0.], [0., 2. * a, 0.], [0., 2. * a, 1.], [0., 0., 1.]];
        let triangle =
            |corners, group| Triangle { corners, group, material: group, smoothing: None };
        let quads = [(0, [0, 1, 2]), (0, [0, 2, 3]), (1, [4, 5, 6]), (1, [4, 6, 7])];
        let materials =
            vec![Material::grey("floor", floor_reflectance), Material::grey("wall", 0.0)];
        let scene = Scene::new(
            floor.iter().chain(&wall).map(|&p| DVec3::from_array(p)).collect(),
            quads.map(|(group, corners)| triangle(corners, group)).to_vec(),
            ["floor", "wall"].map(String::from).to_vec(),
            materials,
        );
        Mesh::new(scene.unwrap(), 5f64.sqrt() * SIDE).unwrap()
    }

    /// Elements of the wall with what `wall` says of a place, and of the floor with what they get
    /// from it when patches send the mean of their elements.
    fn lit(mesh: &Mesh, wall: &dyn Fn(DVec3) -> f64) -> Vec<Rgb> {
        let nodes: Vec<_> = (0..mesh.element_count()).map(|e| mesh.element(e)).collect();
        let on_wall = |n| mesh.normal(n).x > 0.5;
        let given = |&n: &_| Rgb::splat(if on_wall(n) { wall(mesh.centroid(n)) } else { 0.0 });
        let mut values: Vec<Rgb> = nodes.iter().map(given).collect();
        let shot = shot_radiosity(mesh, &values);
        for (e, &n) in nodes.iter().enumerate().filter(|(_, n)| !on_wall(**n)) {
            let from = |(&m, b): (&_, &Rgb)| {
                b.x * point_to_polygon(mesh.centroid(n), mesh.normal(n), &mesh.corners(m))
            };
            let incident: f64 = nodes.iter().zip(&shot).filter(|s| s.1.x > 0.0).map(from).sum();
            values[e] = mesh.material(n).reflectance * incident;
        }
        values
    }

    /// The floor's value at the middle of the edge: as the plain fit has it, and corrected.
    fn at_the_edge(mesh: &Mesh, values: &[Rgb]) -> [f64; 2] {
        let Vertices { positions, outlines, .. } =
            Vertices::new(mesh, &SurfaceTopology::new(mesh.scene()));
        let on_floor = first_at(&positions, DVec3::new(0.0, 1.0, 0.0));
        let normals: Vec<DVec3> = normals(mesh, &outlines, positions.len());
        let value = |values: &[Rgb]| {
            let averaged = vec![Rgb::ZERO; positions.len()];
            let at_boundary =
                boundary_values(mesh, &outlines, &positions, &normals, values, &averaged);
            at_boundary.iter().find(|(v, _)| *v == on_floor).expect("a boundary vertex").1.x
        };
        // A dark wall has nothing to take out: what is left is the fit.
        let dark = |e: usize| mesh.normal(mesh.element(e)).x > 0.5;
        let alone = (0..values.len()).map(|e| if dark(e) { Rgb::ZERO } else { values[e] });
        [value(&alone.collect::<Vec<_>>()), value(values)]
    }

    /// The floor comes first, and so do its vertices.
    fn first_at(positions: &[DVec3], place: DVec3) -> usize {
        positions.iter().position(|p| p.distance(place) < 1e-9).expect("a vertex")
    }

    fn normals(mesh: &Mesh, outlines: &ElementLoops, count: usize) -> Vec<DVec3> {
        let mut normals = vec![DVec3::ZERO; count];
        for (e, outline) in outlines.iter() {
            for &v in outline {
                normals[v as usize] = mesh.normal(mesh.element(e));
            }
        }
        normals
    }

    #[test]
    fn too_many_vertices_at_one_position_are_not_corrected() {
        let coincident = |triangles: usize| {
            // A fan of separate triangles: their first corners are at one place.
            let rim = |k: usize| {
                let (sin, cos) = (k as f64 / triangles as f64).sin_cos();
                DVec3::new(cos, sin, (k / 2 % 2) as f64)
            };
            let corners = |k: usize| [DVec3::ZERO, rim(2 * k), rim(2 * k + 1)];
            let triangle =
                |k: u32| Triangle { corners: [3 * k, 3 * k + 1, 3 * k + 2], ..Default::default() };
            let scene = Scene::new(
                (0..triangles).flat_map(corners).collect(),
                (0..triangles as u32).map(triangle).collect(),
                vec!["fan".into()],
                vec![Material::grey("fan", 0.5)],
            );
            let mesh = Mesh::new(scene.unwrap(), f64::INFINITY).unwrap();
            let Vertices { positions, outlines, .. } =
                Vertices::new(&mesh, &SurfaceTopology::new(mesh.scene()));
            let normals = normals(&mesh, &outlines, positions.len());
            let boundary = boundary_vertices(&mesh, &outlines, &positions, &normals);
            coincident_vertices(&mesh, &boundary)[0].len()
        };
        assert_eq!(coincident(MAX_COINCIDENT), MAX_COINCIDENT - 1);
        assert_eq!(coincident(MAX_COINCIDENT + 1), 0);
    }

    #[test]
    fn floor_at_edge_receives_half_of_the_wall_s_value_there() {
        let mesh = corner(0.8);
        for (at_edge, slope) in [(0.0, 1.0), (1.0, -1.0), (0.5, 2.0)] {
            let values = lit(&mesh, &|p| at_edge + slope * p.z);
            let [plain, corrected] = at_the_edge(&mesh, &values).map(|b| b - 0.8 * at_edge / 2.0);
            println!("{at_edge} {slope:+}: plain {plain:+.4}, corrected {corrected:+.4}");
            // What the wall has beyond R = 3 elements is left in: in place of ln(2H/d) it brings
            // ln(H/R) − ¾ (d/R)² to the floor (series of the integral in the module's text), so a
            // fit over d ≤ 2 elements has ¾ (2/3)² = ⅓ of its curvature to cope with, at most.
            assert!(plain.abs() > 0.01 && corrected.abs() < plain.abs() / 3.0);
        }
    }

    #[test]
    fn constant_wall_changes_nothing() {
        let mesh = corner(0.8);
        let values = lit(&mesh, &|_| 3.0);
        let [plain, corrected] = at_the_edge(&mesh, &values);
        // Some 100 terms of about 1: rounding only.
        assert!((plain - corrected).abs() < 1e-13, "{plain} {corrected}");
    }

    #[test]
    fn coincidence_ignores_rounding_and_nothing_else() {
        let vertex = |x: f64| {
            let position = DVec3::new(0.0, x, 0.0);
            BoundaryVertex { vertex: 0, position, fit: vec![], neighbourhood: vec![] }
        };
        let boundary = [0.5, 0.25, 0.5 + 1e-15, 0.5 + 1e-4, 0.5 - 1e-15].map(vertex);
        let met = coincident_vertices(&corner(0.5), &boundary);
        assert_eq!(met, [vec![2, 4], vec![], vec![0, 4], vec![], vec![0, 2]]);
    }

    #[test]
    fn gains_sum_to_at_most_the_reflectance() {
        let mesh = corner(0.8);
        let Vertices { positions, outlines, .. } =
            Vertices::new(&mesh, &SurfaceTopology::new(mesh.scene()));
        let boundary = boundary_vertices(
            &mesh,
            &outlines,
            &positions,
            &normals(&mesh, &outlines, positions.len()),
        );
        let middle = |p: &BoundaryVertex| p.position.distance(DVec3::Y) < 1e-9;
        let [k, other] =
            [0, 1].map(|n| (0..boundary.len()).filter(|&k| middle(&boundary[k])).nth(n).unwrap());
        let shot = vec![Rgb::ONE; mesh.element_count()];
        let gain = |others: &[usize]| -> f64 {
            edge_exchanges(&mesh, &boundary, k, others, &shot).iter().map(|x| x.gain.x).sum()
        };
        // Half of the sky is the wall; within a few elements of reach, some of it is not.
        assert!(gain(&[other]) > 0.3 && gain(&[other]) < 0.8 * 0.6, "{}", gain(&[other]));
        assert!((gain(&[other; 5]) - 0.8).abs() < 1e-14);
    }

    /// Weights of opposite signs, each far above one: the sum of what they extrapolate is small.
    #[test]
    fn factors_of_opposite_signs_amplify_nothing() {
        let mesh = corner(0.8);
        let Vertices { positions, outlines, .. } =
            Vertices::new(&mesh, &SurfaceTopology::new(mesh.scene()));
        let normals = normals(&mesh, &outlines, positions.len());
        let mut boundary = boundary_vertices(&mesh, &outlines, &positions, &normals);
        let middle = |p: &BoundaryVertex| p.position.distance(DVec3::Y) < 1e-9;
        let met: Vec<usize> = (0..boundary.len()).filter(|&k| middle(&boundary[k])).collect();
        for (n, (_, weight)) in boundary[met[0]].fit.iter_mut().enumerate() {
            *weight = if n % 3 == 0 { 100.0 } else { -100.0 };
        }
        // Whatever is lit: one element of the wall after the other.
        for lit in 0..mesh.element_count() {
            let mut shot = vec![Rgb::ZERO; mesh.element_count()];
            shot[lit] = Rgb::ONE;
            for exchange in edge_exchanges(&mesh, &boundary, met[0], &met[1..], &shot) {
                assert!(exchange.received.abs().max_element() <= 0.8, "{}", exchange.received);
            }
        }
    }

    #[test]
    fn no_value_is_below_zero() {
        let mesh = corner(0.8);
        let values = lit(&mesh, &|p| if p.z < SIDE { 0.0 } else { 1e6 });
        let Vertices { positions, outlines, .. } =
            Vertices::new(&mesh, &SurfaceTopology::new(mesh.scene()));
        let normals = normals(&mesh, &outlines, positions.len());
        let averaged = vec![Rgb::ZERO; positions.len()];
        let at_boundary =
            boundary_values(&mesh, &outlines, &positions, &normals, &values, &averaged);
        assert!(at_boundary.iter().all(|(_, b)| b.is_finite() && b.min_element() >= 0.0));
        assert!(at_boundary.iter().any(|(_, b)| b.x == 0.0), "some would have gone below");
    }
}
