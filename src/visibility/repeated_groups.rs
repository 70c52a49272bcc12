//! Groups of a scene that are images of one another, as an object that is placed many times is.
//!
//! ```text
//!   group 0    group 1      group 2         Four corners that span most of a group determine the
//!   ╱╲         ╲╱           ╱╲              affine map to another of the same topology; all other
//!  ╱  ╲  ───►  ╱╲  and ───► ╲ ╲             corners must be where it takes them, within rounding.
//! ╱────╲      ╱──╲           ╲─╲
//! ```
//!
//! They are found by their geometry: files of any format have them, and triangles that were dropped
//! or cut make a group different from the others and no more.

use std::collections::BTreeSet;
use std::hash::{Hash, Hasher};
use std::ops::Range;

use glam::{DAffine3, DMat3, DVec3};
use rustc_hash::{FxHashMap, FxHasher};

use crate::scene::Scene;

/// Fewest triangles of a group that is worth a ray's way to another frame: an instance takes as
/// much memory as one. Plain choice.
const MIN_TRIANGLES: usize = 8;

/// Shapes that a group is compared with, at most, of those whose [`affine_invariant`] is next above
/// its own, and next below: only rounding is between equal ones. Plain choice.
const MAX_COMPARED: usize = 2;

/// Distance of corners from where the map takes them, in steps between coordinates: positions are
/// rounded when an object is placed, twice, and four of them determine the map. Far below 64 steps,
/// within which surfaces are in contact (see [`offset`](super::offset)).
const TOLERANCE: f64 = 8.0;

/// Thickness of a shape over its length: its corners' rounding tilts thinner ones. Plain choice.
const MIN_THICKNESS: f64 = 1e-3;

/// Groups that are images of one another.
#[derive(Debug, Default)]
pub(super) struct RepeatedGroups {
    /// The triangles of each shape: those of the first group that has it.
    pub shapes: Vec<Range<usize>>,
    /// All groups that have a shape of which there are several.
    pub images: Vec<Image>,
    /// All other triangles.
    pub others: Vec<u32>,
}

/// A group as the image of a shape.
#[derive(Clone, Debug)]
pub(super) struct Image {
    /// Index of the shape.
    pub shape: usize,
    /// Its triangles, in the order of those of the shape.
    pub triangles: Range<usize>,
    /// From the group to the shape.
    pub to_shape: DAffine3,
}

/// A shape, and the four corners that determine maps of it.
struct Shape {
    triangles: Range<usize>,
    /// Of triangles counted from the first.
    corners: [(usize, usize); 4],
    /// Inverse of the matrix of steps from the first of them to the others.
    inverse: DMat3,
    /// Groups that have it.
    images: usize,
}

impl RepeatedGroups {
    /// The repeated groups of `scene` all of whose triangles are `included`; of the others those
    /// triangles that are.
    pub fn of_scene(scene: &Scene, included: impl Fn(usize) -> bool) -> RepeatedGroups {
        let mut shapes: Vec<Shape> = vec![];
        let mut known: FxHashMap<u64, BTreeSet<(u64, usize)>> = FxHashMap::default();
        let (mut images, mut others) = (vec![], vec![]);
        let mut first = 0;
        for run in scene.triangles().chunk_by(|a, b| a.group == b.group) {
            let triangles = first..first + run.len();
            first = triangles.end;
            let is_whole = run.len() >= MIN_TRIANGLES && triangles.clone().all(&included);
            let mut image_of = || {
                let known = known.entry(topology(scene, &triangles)).or_default();
                let invariant = affine_invariant(scene, &triangles)?;
                // Of positive numbers the bits have the order.
                let at = invariant.to_bits();
                let above = known.range((at, 0)..).take(MAX_COMPARED);
                let below = known.range(..(at, 0)).rev().take(MAX_COMPARED);
                let mut alike = above.chain(below);
                let image = alike.find_map(|&(_, shape)| {
                    Some((shape, shapes[shape].map_from(scene, &triangles)?))
                });
                image.or_else(|| {
                    shapes.push(Shape::new(scene, triangles.clone())?);
                    known.insert((invariant.to_bits(), shapes.len() - 1));
                    Some((shapes.len() - 1, DAffine3::IDENTITY))
                })
            };
            match is_whole.then(&mut image_of).flatten() {
                Some((shape, to_shape)) => {
                    shapes[shape].images += 1;
                    images.push(Image { shape, triangles, to_shape });
                }
                None => others.extend(triangles.filter(|&t| included(t)).map(|t| t as u32)),
            }
        }
        let mut numbers = vec![];
        let mut kept = vec![];
        for shape in &shapes {
            numbers.push(kept.len());
            if shape.images > 1 {
                kept.push(shape.triangles.clone());
            }
        }
        images.retain_mut(|image: &mut Image| {
            let is_repeated = shapes[image.shape].images > 1;
            if !is_repeated {
                others.extend(image.triangles.clone().map(|t| t as u32));
            }
            image.shape = numbers[image.shape];
            is_repeated
        });
        others.sort_unstable();
        RepeatedGroups { shapes: kept, images, others }
    }

    /// Triangles that need not be stored since others have their shape.
    pub fn saved(&self) -> usize {
        let stored: usize = self.shapes.iter().map(Range::len).sum();
        self.images.iter().map(|image| image.triangles.len()).sum::<usize>() - stored
    }
}

/// A hash that is the same for groups whose triangles share corners alike and have alike covered
/// backs.
fn topology(scene: &Scene, triangles: &Range<usize>) -> u64 {
    let mut hasher = FxHasher::default();
    let base = scene.triangles()[triangles.start].corners[0];
    for t in triangles.clone() {
        scene.triangles()[t].corners.map(|corner| corner.wrapping_sub(base)).hash(&mut hasher);
        scene.is_back_covered(t).hash(&mut hasher);
    }
    hasher.finish()
}

/// A number that no affine map of these triangles changes: with d the volume of a triangle and the
/// mean corner, Σ d² / (Σ |d|)². None where there is no volume.
fn affine_invariant(scene: &Scene, triangles: &Range<usize>) -> Option<f64> {
    let corners = || triangles.clone().flat_map(|t| scene.corners(t));
    let mean = corners().sum::<DVec3>() / (3 * triangles.len()) as f64;
    let (mut sum, mut squares) = (0.0, 0.0);
    for t in triangles.clone() {
        let [a, b, c] = scene.corners(t).map(|corner| corner - mean);
        let volume = a.dot(b.cross(c)).abs();
        sum += volume;
        squares += volume * volume;
    }
    Some(squares / (sum * sum)).filter(|ratio| ratio.is_finite() && *ratio > 0.0)
}

impl Shape {
    /// The shape of these triangles; none if they are almost in one plane, or a crowd of points.
    fn new(scene: &Scene, triangles: Range<usize>) -> Option<Shape> {
        let of = |(t, k): (usize, usize)| scene.corners(triangles.start + t)[k];
        let all = || (0..triangles.len()).flat_map(|t| [0, 1, 2].map(|k| (t, k)));
        let furthest = |measure: &dyn Fn(DVec3) -> f64| {
            all().max_by(|&a, &b| measure(of(a)).total_cmp(&measure(of(b))))
        };
        // Each as far as possible from what those before it span.
        let a = of((0, 0));
        let b = furthest(&|p| p.distance_squared(a))?;
        let along = of(b) - a;
        let c = furthest(&|p| along.cross(p - a).length_squared())?;
        let normal = along.cross(of(c) - a);
        let d = furthest(&|p| normal.dot(p - a).abs())?;
        let corners = [(0, 0), b, c, d];
        let matrix = steps(corners.map(of));
        let thickness = normal.normalize_or_zero().dot(of(d) - a).abs();
        let is_thick = thickness > MIN_THICKNESS * along.length();
        let inverse = matrix.inverse();
        (is_thick && inverse.is_finite()).then_some(Shape {
            triangles,
            corners,
            inverse,
            images: 0,
        })
    }

    /// The map from these triangles, if they are an image of the shape that is no mirror image.
    fn map_from(&self, scene: &Scene, triangles: &Range<usize>) -> Option<DAffine3> {
        let at = |first: usize| move |(t, k): (usize, usize)| scene.corners(first + t)[k];
        let (of_shape, of_image) = (at(self.triangles.start), at(triangles.start));
        let [a, b] = [self.corners.map(of_shape), self.corners.map(of_image)];
        let matrix = steps(b) * self.inverse;
        // The normals of mirror images point to the other side.
        if self.triangles.len() != triangles.len() || matrix.determinant() <= 0.0 {
            return None;
        }
        let from_shape = DAffine3::from_mat3_translation(matrix, b[0] - matrix * a[0]);
        let inverse = steps(a) * steps(b).inverse();
        let to_shape = DAffine3::from_mat3_translation(inverse, a[0] - inverse * b[0]);
        let tolerance = TOLERANCE * scene.coordinate_ulp();
        let is_image = (0..triangles.len()).all(|t| {
            let [p, q] = [&self.triangles, triangles].map(|all| scene.corners(all.start + t));
            p.into_iter().zip(q).all(|(p, q)| {
                from_shape.transform_point3(p).distance(q) <= tolerance
                    && to_shape.transform_point3(q).distance(p) <= tolerance
            })
        });
        is_image.then_some(to_shape)
    }
}

/// The steps from the first of four points to the others.
fn steps([a, b, c, d]: [DVec3; 4]) -> DMat3 {
    DMat3::from_cols(b - a, c - a, d - a)
}
