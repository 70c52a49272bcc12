//! Where surfaces meet: what a vertex there gets from the other surface.
//!
//! Let radiosity on a wall rise by b per length from its edge with a floor. At distance d from that
//! edge the floor gets ∫ b h dF from it, up to a height H: (b d / 2)(ln(2H/d) − 1) for d ≪ H, since
//! F = (1 − d/√(d² + h²)) / 2 of what is lower than h. That is infinitely steep at the edge (K. E.
//! Atkinson, "The planar radiosity equation and its numerical solution", IMA J. Numer. Anal. 20,
//! 2000, on such corners), so that a line through the floor's elements ends too high there, or too
//! low if b < 0. But it is known what bends: light from what the wall has more or less, next to the
//! edge, than at the edge itself, and in the limit d → 0 that is nothing. So it is taken out of the
//! elements' values, and the line goes through the rest: the singularity is subtracted. Where the
//! wall is even there is nothing to take out, and constants stay what they are.
//!
//! Only vertices at one place take part, with the few elements about them, and nothing is asked of
//! what stands between these.

use std::collections::HashMap;

use glam::DVec3;
use rayon::prelude::*;

use super::boundary_fit::BoundaryVertex;
use crate::form_factor::closed_form::point_to_polygon;
use crate::mesh::{Mesh, NodeId};
use crate::scene::Rgb;

/// Vertices nearer than this share of the scene's extent are at one place. A power of two, so that
/// places at binary fractions of the extent lie well inside a cell, not where rounding decides.
const SAME_PLACE: f64 = 1.0 / (1 << 20) as f64;

/// Where more vertices are at one place, none hears of another: what each hears of takes time and
/// memory. Three meet in the corner of a room; so many are a scene that is small in its extent.
const MOST_MEETING: usize = 256;

/// How often vertices at one place hear of each other's value. Each passes on at most ρ F of what
/// is still off, F = ½ between perpendicular walls: 3 % is left of it.
const ROUNDS: usize = 5;

/// Elements of a patch where surfaces meet, about: the Cornell box in elements of 30 mm has this many
/// there, and its edges come out worse for 4 and for 64.
const PATCH: usize = 16;

/// What an end gets from the surface of another one at the same place, W/m²: `gain` times the
/// radiosity at that end, less `near`.
struct Exchange {
    other: usize,
    gain: Rgb,
    near: Rgb,
}

/// The radiosity of all `ends`, from what was `fitted` to their elements; none below zero.
pub(super) fn mend(
    mesh: &Mesh,
    ends: &[BoundaryVertex],
    elements: &[Rgb],
    fitted: &[Rgb],
) -> Vec<Rgb> {
    let meeting = meeting(mesh, ends);
    let shot = as_shot(mesh, elements);
    let exchanges: Vec<Vec<Exchange>> = (0..ends.len())
        .into_par_iter()
        .map(|k| exchanges(mesh, ends, k, &meeting[k], &shot))
        .collect();
    let mut values: Vec<Rgb> = fitted.iter().map(|b| b.max(Rgb::ZERO)).collect();
    for _ in 0..ROUNDS {
        let value = |(&fitted, exchanges): (&Rgb, &Vec<Exchange>)| {
            let got = exchanges.iter().map(|x| x.gain * values[x.other] - x.near);
            (fitted + got.sum::<Rgb>()).max(Rgb::ZERO)
        };
        values = fitted.iter().zip(&exchanges).map(value).collect();
    }
    values
}

/// For each of `ends` the others at its place, if they are not too many.
fn meeting(mesh: &Mesh, ends: &[BoundaryVertex]) -> Vec<Vec<usize>> {
    let bounds = mesh.scene().bounds();
    let unit = bounds.longest_side() * SAME_PLACE;
    let place = |end: &BoundaryVertex| ((end.position - bounds.low) / unit).round().as_i64vec3();
    let mut places: HashMap<_, Vec<usize>> = HashMap::new();
    ends.iter().zip(0..).for_each(|(end, k)| places.entry(place(end)).or_default().push(k));
    let others = |k: usize| {
        let here = Some(&places[&place(&ends[k])]).filter(|here| here.len() <= MOST_MEETING);
        here.into_iter().flatten().copied().filter(move |&m| m != k)
    };
    (0..ends.len()).map(|k| others(k).collect()).collect()
}

/// Radiosity as the solver shot it: patches send the mean of their elements. The elements' values
/// came about by this, and so only this can be taken out of them again. Emitters shoot as elements;
/// where surfaces meet, patches are small; this takes them for [`PATCH`].
fn as_shot(mesh: &Mesh, elements: &[Rgb]) -> Vec<Rgb> {
    fn smooth(mesh: &Mesh, node: NodeId, shot: &mut [Rgb]) {
        let elements = mesh.elements_of(node);
        match mesh.children(node) {
            Some(children) if elements.len() > PATCH => {
                children.iter().for_each(|&k| smooth(mesh, k, shot));
            }
            _ => {
                let count = elements.len() as f64;
                let mean = shot[elements.clone()].iter().sum::<Rgb>() / count;
                shot[elements].fill(mean);
            }
        }
    }
    let mut shot = elements.to_vec();
    let dark = |t: &usize| mesh.scene().material(*t).exitance == Rgb::ZERO;
    let triangles = (0..mesh.scene().triangles().len()).filter(dark);
    triangles.for_each(|t| smooth(mesh, mesh.root(t), &mut shot));
    shot
}

/// What end `k` gets from the surfaces of the `others` at its place.
fn exchanges(
    mesh: &Mesh,
    ends: &[BoundaryVertex],
    k: usize,
    others: &[usize],
    shot: &[Rgb],
) -> Vec<Exchange> {
    let Some(&(first, _)) = ends[k].fit.first() else { return vec![] };
    let reflectance = mesh.material(mesh.element(first as usize)).reflectance;
    let viewer = |&(e, weight): &(u32, f64)| {
        let node = mesh.element(e as usize);
        (mesh.centroid(node), mesh.normal(node), weight)
    };
    let viewers: Vec<(DVec3, DVec3, f64)> = ends[k].fit.iter().map(viewer).collect();
    // The fit's value at the end, of form factors from the elements that it goes through.
    let factor = |j: u32| -> f64 {
        let polygon = mesh.corners(mesh.element(j as usize));
        viewers.iter().map(|&(p, n, weight)| weight * point_to_polygon(p, n, &polygon)).sum()
    };
    let (mut total, mut exchanges) = (0.0, vec![]);
    for &other in others {
        let (mut gain, mut near) = (0.0, Rgb::ZERO);
        for &j in &ends[other].wide {
            let factor = factor(j);
            gain += factor;
            near += shot[j as usize] * factor;
        }
        total += gain;
        exchanges.push(Exchange { other, gain: reflectance * gain, near: reflectance * near });
    }
    // An extrapolated factor can be too large: nobody sees more than everything.
    let most = 1.0 / f64::max(total, 1.0);
    exchanges.iter_mut().for_each(|x| (x.gain, x.near) = (x.gain * most, x.near * most));
    exchanges
}

#[cfg(test)]
mod tests {
    use super::super::boundary_fit::{ends, extrapolate};
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
        let shot = as_shot(mesh, &values);
        for (e, &n) in nodes.iter().enumerate().filter(|(_, n)| !on_wall(**n)) {
            let from = |(&m, b): (&_, &Rgb)| {
                b.x * point_to_polygon(mesh.centroid(n), mesh.normal(n), &mesh.corners(m))
            };
            let incident: f64 = nodes.iter().zip(&shot).filter(|s| s.1.x > 0.0).map(from).sum();
            values[e] = mesh.material(n).reflectance * incident;
        }
        values
    }

    /// The floor's value at the middle of the edge: as the plain fit has it, and mended.
    fn at_the_edge(mesh: &Mesh, values: &[Rgb]) -> [f64; 2] {
        let Vertices { positions, outlines: rims, .. } =
            Vertices::new(mesh, &SurfaceTopology::new(mesh.scene()));
        let on_floor = first_at(&positions, DVec3::new(0.0, 1.0, 0.0));
        let normals: Vec<DVec3> = normals(mesh, &rims, positions.len());
        let value = |values: &[Rgb]| {
            let mut out = vec![Rgb::ZERO; positions.len()];
            extrapolate(mesh, &rims, &positions, &normals, values, &mut out);
            out[on_floor].x
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

    fn normals(mesh: &Mesh, rims: &ElementLoops, count: usize) -> Vec<DVec3> {
        let mut normals = vec![DVec3::ZERO; count];
        for (e, rim) in rims.iter() {
            rim.iter().for_each(|&v| normals[v as usize] = mesh.normal(mesh.element(e)));
        }
        normals
    }

    #[test]
    fn crowded_boxes_skip_each_other() {
        let heard = |triangles: usize| {
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
            let Vertices { positions, outlines: rims, .. } =
                Vertices::new(&mesh, &SurfaceTopology::new(mesh.scene()));
            let normals = normals(&mesh, &rims, positions.len());
            let ends = ends(&mesh, &rims, &positions, &normals);
            meeting(&mesh, &ends)[0].len()
        };
        assert_eq!(heard(MOST_MEETING), MOST_MEETING - 1);
        assert_eq!(heard(MOST_MEETING + 1), 0);
    }

    #[test]
    fn floor_at_edge_receives_half_of_wall() {
        let mesh = corner(0.8);
        for (at_edge, slope) in [(0.0, 1.0), (1.0, -1.0), (0.5, 2.0)] {
            let values = lit(&mesh, &|p| at_edge + slope * p.z);
            let [plain, mended] = at_the_edge(&mesh, &values).map(|b| b - 0.8 * at_edge / 2.0);
            println!("{at_edge} {slope:+}: plain {plain:+.4}, mended {mended:+.4}");
            // What the wall has beyond R = 3 elements is left in: in place of ln(2H/d) it brings
            // ln(H/R) − ¾ (d/R)² to the floor (series of the integral in the module's text), so a
            // fit over d ≤ 2 elements has ¾ (2/3)² = ⅓ of its curvature to cope with, at most.
            assert!(plain.abs() > 0.01 && mended.abs() < plain.abs() / 3.0);
        }
    }

    #[test]
    fn even_wall_is_unchanged() {
        let mesh = corner(0.8);
        let values = lit(&mesh, &|_| 3.0);
        let [plain, mended] = at_the_edge(&mesh, &values);
        // Some 100 terms of about 1: rounding only.
        assert!((plain - mended).abs() < 1e-13, "{plain} {mended}");
    }

    #[test]
    fn segment_ends_meet_despite_rounding() {
        let end = |x: f64| {
            let position = DVec3::new(0.0, x, 0.0);
            BoundaryVertex { vertex: 0, position, fit: vec![], wide: vec![] }
        };
        let ends = [0.5, 0.25, 0.5 + 1e-15, 0.5 + 1e-4, 0.5 - 1e-15].map(end);
        let met = meeting(&corner(0.5), &ends);
        assert_eq!(met, [vec![2, 4], vec![], vec![0, 4], vec![], vec![0, 2]]);
    }

    #[test]
    fn boundary_end_sees_at_most_everything() {
        let mesh = corner(0.8);
        let Vertices { positions, outlines: rims, .. } =
            Vertices::new(&mesh, &SurfaceTopology::new(mesh.scene()));
        let ends = ends(&mesh, &rims, &positions, &normals(&mesh, &rims, positions.len()));
        let middle = |p: &BoundaryVertex| p.position.distance(DVec3::Y) < 1e-9;
        let [k, other] =
            [0, 1].map(|n| (0..ends.len()).filter(|&k| middle(&ends[k])).nth(n).unwrap());
        let shot = vec![Rgb::ONE; mesh.element_count()];
        let gain = |others: &[usize]| -> f64 {
            exchanges(&mesh, &ends, k, others, &shot).iter().map(|x| x.gain.x).sum()
        };
        // Half of the sky is the wall; within a few elements of reach, some of it is not.
        assert!(gain(&[other]) > 0.3 && gain(&[other]) < 0.8 * 0.6, "{}", gain(&[other]));
        assert!((gain(&[other; 5]) - 0.8).abs() < 1e-14);
    }

    #[test]
    fn bright_wall_foot_stays_nonnegative() {
        let mesh = corner(0.8);
        let values = lit(&mesh, &|p| if p.z < SIDE { 0.0 } else { 1e6 });
        let Vertices { positions, outlines: rims, .. } =
            Vertices::new(&mesh, &SurfaceTopology::new(mesh.scene()));
        let normals = normals(&mesh, &rims, positions.len());
        let mut out = vec![Rgb::ZERO; positions.len()];
        extrapolate(&mesh, &rims, &positions, &normals, &values, &mut out);
        assert!(out.iter().all(|b| b.is_finite() && b.min_element() >= 0.0));
        assert!(out.iter().any(|b| b.x == 0.0), "some would have gone below");
    }
}
