//! Surfaces with two sides, which are triangles in one place, as ray tracers can show them.
//!
//! Rasterisers leave out the backs of faces. Ray tracers do not: of two faces in one place each ray
//! meets either, and Cycles shows speckle. So one triangle of each such pair is moved to where its
//! front looks, or left out, where the light of both sides is the same.
//!
//! ```text
//!    front of t                       front of t
//!   ━━━━━━━━━━━━━  t and s           ────────────── t
//!    front of s                      ────────────── s, a gap below
//!                                     front of s
//! ```

use std::collections::BTreeMap;

use glam::DVec3;
use rustc_hash::{FxHashMap, FxHashSet};

use crate::gather::{GatheredMesh, RadiosityField};
use crate::geometry::aabb::Aabb;
use crate::geometry::union_find::UnionFind;
use crate::scene::{Rgb, Scene};

/// The gap between two sides as a fraction of the scene's diagonal. Ray tracers compute in 32 bits,
/// and Cycles starts rays 32 steps of these off a surface: up to 4e-6 of the largest coordinate,
/// which is at most 16 diagonals here ([`write_glb`](crate::write_glb)), so 6e-5. Measured with
/// Cycles 5.0.1 from a diagonal away: a fifth to all of the pixels show the wrong side at 1e-7 of
/// the diagonal, none from 1e-6 on; at 1e-3 the rim is seen.
const GAP: f64 = 1e-4;

/// The largest gap as a fraction of the diagonal of a connected surface: leaves on a ground of a
/// kilometre keep their shape. Plain choice.
const LARGEST_GAP: f64 = 1e-2;

/// The triangles of a scene that lie where others do.
#[derive(Default)]
pub(super) struct TwoSides {
    /// By how much the corners of triangles are moved, scene unit; none of those that stay.
    shifts: FxHashMap<usize, [DVec3; 3]>,
    omitted: FxHashSet<usize>,
    double_sided: FxHashSet<usize>,
}

impl TwoSides {
    /// With a gap between all of them.
    #[cfg(feature = "light-map")]
    pub fn apart(scene: &Scene) -> TwoSides {
        let mut sides = TwoSides::default();
        sheets(scene).iter().for_each(|sheet| sides.move_apart(scene, sheet));
        sides
    }

    /// With a gap where the two sides differ in their light, which has this `error` as a share; one
    /// double-sided triangle for both where they do not.
    pub fn of_light(light: &GatheredMesh, error: f64) -> TwoSides {
        let (scene, mut sides) = (light.mesh.scene(), TwoSides::default());
        let sheets = sheets(scene);
        let twins = twins(scene, &sheets);
        let points = sample_points(light, &twins);
        for sheet in &sheets {
            let of_sheet: Option<Vec<usize>> =
                sheet.iter().map(|s| twins.get(s).copied()).collect();
            match of_sheet.filter(|twins| has_equal_light(light, [sheet, twins], &points, error)) {
                Some(twins) => {
                    sides.omitted.extend(sheet);
                    sides.double_sided.extend(twins);
                }
                None => sides.move_apart(scene, sheet),
            }
        }
        sides
    }

    /// Whether triangle `t` is left out.
    pub fn is_omitted(&self, t: usize) -> bool {
        self.omitted.contains(&t)
    }

    /// Whether triangle `t` stands for both sides.
    pub fn is_double_sided(&self, t: usize) -> bool {
        self.double_sided.contains(&t)
    }

    /// By how much the point of triangle `t` with these weights of the second and third corner is
    /// moved, scene unit.
    pub fn shift(&self, t: usize, [u, v]: [f64; 2]) -> DVec3 {
        let Some([a, b, c]) = self.shifts.get(&t) else { return DVec3::ZERO };
        a * (1.0 - u - v) + b * u + c * v
    }

    /// Whether triangle `t` is moved.
    pub fn is_moved(&self, t: usize) -> bool {
        self.shifts.contains_key(&t)
    }

    /// Moves the triangles of a `sheet` to where their fronts look: all of those at a corner in one
    /// direction, so that the sheet stays closed.
    fn move_apart(&mut self, scene: &Scene, sheet: &[usize]) {
        let bounds = Aabb::from_points(sheet.iter().flat_map(|&s| scene.corners(s)));
        let gap = (GAP * scene.bounds().diagonal()).min(LARGEST_GAP * bounds.diagonal());
        let mut directions: FxHashMap<[u64; 3], DVec3> = FxHashMap::default();
        for &s in sheet {
            for corner in scene.corners(s) {
                *directions.entry(bits(corner)).or_default() += scene.area(s) * scene.normal(s);
            }
        }
        for &s in sheet {
            let shift = |p: DVec3| gap * directions[&bits(p)].normalize_or_zero();
            self.shifts.insert(s, scene.corners(s).map(shift));
        }
    }
}

/// Of triangles in one place, those whose light shines the other way: in connected surfaces, in
/// their order.
fn sheets(scene: &Scene) -> Vec<Vec<usize>> {
    let seconds = scene.second_sides();
    if seconds.is_empty() {
        return vec![];
    }
    let welded = scene.welded_corners();
    let corners = &welded.corners;
    let mut connected = UnionFind::new(welded.positions);
    for &s in &seconds {
        let [a, b, c] = corners[s].map(|corner| corner as usize);
        connected.join(a, b);
        connected.join(b, c);
    }
    let mut sheets: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for &s in &seconds {
        sheets.entry(connected.find(corners[s][0] as usize)).or_default().push(s);
    }
    sheets.into_values().collect()
}

/// Of triangles the one of which each is the other side: of the same corners, group and look.
fn twins(scene: &Scene, sheets: &[Vec<usize>]) -> FxHashMap<usize, usize> {
    let ascending = |t: usize| {
        let mut corners = scene.corners(t).map(bits);
        corners.sort_unstable();
        corners
    };
    let mut by_corners: FxHashMap<_, Vec<usize>> = FxHashMap::default();
    for &s in sheets.iter().flatten() {
        by_corners.entry(ascending(s)).or_default();
    }
    for t in 0..scene.triangles().len() {
        if let Some(triangles) = by_corners.get_mut(&ascending(t)) {
            triangles.push(t);
        }
    }
    let look = |k: usize| {
        let (triangle, material) = (scene.triangles()[k], scene.material(k));
        (triangle.group, &material.name, material.reflectance, material.exitance)
    };
    let covers = |s: usize, t: usize| scene.back_covers(s).binary_search(&(t as u32)).is_ok();
    let twin = |&s: &usize| {
        let [a, b, c] = scene.corners(s);
        let is_twin = |&&t: &&usize| {
            let has_corners = [[a, c, b], [c, b, a], [b, a, c]].contains(&scene.corners(t));
            has_corners && look(s) == look(t) && covers(s, t) && covers(t, s)
        };
        Some((s, *by_corners[&ascending(s)].iter().find(is_twin)?))
    };
    sheets.iter().flatten().filter_map(twin).collect()
}

/// Coordinates as a key.
fn bits(position: DVec3) -> [u64; 3] {
    (position + DVec3::ZERO).to_array().map(f64::to_bits)
}

/// The positions of vertices on triangles that are twins, by triangle.
fn sample_points(
    light: &GatheredMesh,
    twins: &FxHashMap<usize, usize>,
) -> FxHashMap<usize, Vec<DVec3>> {
    let (surface, mesh) = (&light.surface, &light.mesh);
    let of_both = twins.iter().flat_map(|(&s, &t)| [s, t]);
    let mut points: FxHashMap<usize, Vec<DVec3>> = of_both.map(|t| (t, vec![])).collect();
    if points.is_empty() {
        return points;
    }
    for (face, &element) in surface.faces.iter().zip(&surface.elements) {
        let t = mesh.triangle(mesh.element(element as usize));
        if let Some(points) = points.get_mut(&t) {
            points.extend(face.map(|v| surface.positions[v as usize]));
        }
    }
    points
}

/// Whether the light of both `sides` of a surface, triangles and their twins, differs at none of
/// the `points` by more than three times this `error` of its mean. A normal error is larger than
/// three times its standard deviation in 0.3 % of all cases.
fn has_equal_light(
    light: &GatheredMesh,
    sides: [&[usize]; 2],
    points: &FxHashMap<usize, Vec<DVec3>>,
    error: f64,
) -> bool {
    let (scene, field) = (light.mesh.scene(), light.radiosity_field());
    let (mut largest, mut sum, mut count) = (0.0_f64, 0.0, 0);
    for (&s, &t) in sides[0].iter().zip(sides[1]) {
        for &point in [s, t].iter().flat_map(|k| &points[k]) {
            let [of_s, of_t] = [s, t].map(|k| radiosity(scene, &field, k, point));
            largest = largest.max(of_s.distance(of_t));
            sum += (of_s.length() + of_t.length()) / 2.0;
            count += 1;
        }
    }
    largest <= 3.0 * error * sum / f64::from(count.max(1))
}

/// Radiosity of triangle `t` at a `point` of it, W/m² per channel.
fn radiosity(scene: &Scene, field: &RadiosityField<'_>, t: usize, point: DVec3) -> Rgb {
    // Points of corners are off by rounding.
    let [u, v] = scene.barycentric(t, point).map(|weight| weight.clamp(0.0, 1.0));
    let sum = (u + v).max(1.0);
    field.reflected_at(t, u / sum, v / sum) + scene.exitance(t)
}
