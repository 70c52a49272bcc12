//! Welding of seams: where a smooth surface is cut, both charts show the same light.
//!
//! ```text
//!   chart a │ cut │ chart b      points along the cut, each from four texels of either chart:
//!     · · ·─┼─ ─ ─┼─· · ·        a(x) = Σ w x over its texels,  b(x) likewise
//!     · · ·─┼─ ─ ─┼─· · ·
//! ```
//!
//! The texels near cuts are changed as little as makes both sides agree: the least sum of squares
//! of their changes and of the remaining differences (Iwanicki 2013, "Lighting technology of The
//! Last of Us"), by conjugate gradients (Hestenes and Stiefel 1952) on
//!
//! ```text
//!   (I + w DᵀD) d = −w DᵀD x      x irradiance, d its change, D differences between the sides
//! ```

use glam::DVec2;

use super::atlas::Atlas;
use super::coverage::ROUNDING;
use super::footprint::Footprint;
use crate::mesh::SurfaceTopology;
use crate::scene::Rgb;

/// Weight w of a difference between the sides over that of a texel's change. There are about two
/// points for each texel along a cut, so that some 1/(1 + 2w) of a difference remains. Plain
/// choice.
const WEIGHT: f64 = 10.0;

/// A point on a cut, in the two charts.
type SeamPoint = [Footprint; 2];

/// Makes both sides of all cuts through smooth surfaces agree in `irradiance`.
pub(super) fn weld(atlas: &Atlas, irradiance: &mut [Rgb]) {
    let points = seam_points(atlas);
    if points.is_empty() {
        return;
    }
    // The texels at cuts, numbered consecutively.
    let mut texels: Vec<u32> = points.iter().flatten().flat_map(|side| side.texels).collect();
    texels.sort_unstable();
    texels.dedup();
    let number = |texel: &u32| texels.partition_point(|k| k < texel) as u32;
    let local = |side: Footprint| Footprint { texels: side.texels.each_ref().map(number), ..side };
    let points: Vec<SeamPoint> = points.into_iter().map(|sides| sides.map(local)).collect();
    let values: Vec<Rgb> = texels.iter().map(|&k| irradiance[k as usize]).collect();
    for (&k, change) in texels.iter().zip(changes(&points, &values)) {
        let texel = &mut irradiance[k as usize];
        *texel = (*texel + change).max(Rgb::ZERO);
    }
}

/// Points along all cuts, half a texel or less apart.
fn seam_points(atlas: &Atlas) -> Vec<SeamPoint> {
    let topology = SurfaceTopology::of_scene(atlas.scene());
    let has_place = |t: usize| {
        let [a, b, c] = atlas.corners(t);
        (b - a).perp_dot(c - a).abs() > ROUNDING * ROUNDING
    };
    let mut points = vec![];
    for [(s, k), (t, l)] in topology.shared_edges() {
        let (one, other) = (atlas.corners(s), atlas.corners(t));
        // Opposite windings: the start of one side is the end of the other.
        let [from, to] = [[one[k], other[(l + 1) % 3]], [one[(k + 1) % 3], other[l]]];
        let same = |[a, b]: [DVec2; 2]| a.distance(b) < ROUNDING;
        if same(from) && same(to) || !has_place(s) || !has_place(t) {
            continue;
        }
        let length = from[0].distance(to[0]).max(from[1].distance(to[1]));
        let steps = (2.0 * length).ceil().max(1.0) as u32;
        points.extend((0..=steps).map(|i| {
            let share = f64::from(i) / f64::from(steps);
            [0, 1].map(|side| Footprint::of(from[side].lerp(to[side], share), atlas.size))
        }));
    }
    points
}

/// The changes of the texels with these `values`.
fn changes(points: &[SeamPoint], values: &[Rgb]) -> Vec<Rgb> {
    // w DᵀD x.
    let pull = |x: &[Rgb]| {
        let mut sums = vec![Rgb::ZERO; x.len()];
        for [a, b] in points {
            let difference = WEIGHT * (a.value(x) - b.value(x));
            for (side, sign) in [(a, 1.0), (b, -1.0)] {
                for (&k, weight) in side.texels.iter().zip(side.weights) {
                    sums[k as usize] += sign * weight * difference;
                }
            }
        }
        sums
    };
    let dot = |a: &[Rgb], b: &[Rgb]| a.iter().zip(b).map(|(a, b)| a * b).sum::<Rgb>();
    let ratio = |a: Rgb, b: Rgb| Rgb::select(b.cmpgt(Rgb::ZERO), a / b, Rgb::ZERO);
    let mut change = vec![Rgb::ZERO; values.len()];
    let mut residual: Vec<Rgb> = pull(values).into_iter().map(|x| -x).collect();
    let mut direction = residual.clone();
    let mut square = dot(&residual, &residual);
    let enough = 1e-12 * square;
    // The condition number is about w; a step removes about 1/√w of the error.
    for _ in 0..100 {
        if square.cmple(enough).all() {
            break;
        }
        let image: Vec<Rgb> =
            direction.iter().zip(pull(&direction)).map(|(&d, pulled)| d + pulled).collect();
        let step = ratio(square, dot(&direction, &image));
        for (k, &along) in direction.iter().enumerate() {
            change[k] += step * along;
            residual[k] -= step * image[k];
        }
        let next = dot(&residual, &residual);
        let share = ratio(next, square);
        square = next;
        for (direction, &residual) in direction.iter_mut().zip(&residual) {
            *direction = residual + share * *direction;
        }
    }
    change
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two charts of 2 × 9 texels whose inner columns, 3 and 6 of a map of 10, are cut sides.
    #[test]
    fn two_sides_with_another_light_meet_half_way() {
        let size = [10, 9];
        let at = |x: f64, y: u32| Footprint::of(DVec2::new(x, f64::from(y) / 2.0), size);
        let points: Vec<SeamPoint> = (0..=16).map(|y| [at(2.5, y), at(6.5, y)]).collect();
        let light = |texel: u32| {
            if texel % 10 < 5 { Rgb::new(1.0, 0.0, 5.0) } else { Rgb::new(2.0, 0.0, 5.0) }
        };
        let values: Vec<Rgb> = (0..90).map(light).collect();
        let changed = changes(&points, &values);
        // Both columns next to a cut change by d, those of one side up and of the other down. Per
        // texel along the cut, of 2 points but for the ends: 4 d² + 2 w (1 − 2 d)², least for
        // d = 2 w / (2 + 4 w).
        let wanted = 2.0 * WEIGHT / (2.0 + 4.0 * WEIGHT);
        for row in 2..7 {
            let change = |column: usize| changed[10 * row + column];
            for column in [2, 3] {
                // The ends have three points for two texels; this effect decays inwards.
                assert!((change(column).x - wanted).abs() < 0.01, "{}", change(column));
                assert!((change(column) + change(9 - column)).abs().max_element() < 1e-9);
            }
            assert_eq!((change(0), change(9), change(4)), (Rgb::ZERO, Rgb::ZERO, Rgb::ZERO));
        }
        assert!(changed.iter().all(|c| c.y == 0.0 && c.z.abs() < 1e-12));
    }
}
