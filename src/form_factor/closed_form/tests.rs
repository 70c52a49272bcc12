//! Closed forms against catalogues, series expansions, brute force and each other.

use std::array::from_fn;
use std::f64::consts::PI;

use glam::DVec3;

use super::*;

/// Rounding error of a contour integral of two rectangles: 16 pairs of edges, four terms of at most
/// about 1 each in squares of the pair's size S, each rounded to 2e-16, over 2πA₁; S² is up to 45
/// A₁ here: 16 · 4 · 2e-16 · 45 / 2π = 9e-14.
const ROUNDING: f64 = 1e-13;

fn close(found: f64, right: f64, error: f64) {
    assert!((found - right).abs() <= error, "{found:e}, should be {right:e} ± {error:e}");
}

/// The parallelogram with corner `o` and edges `u`, `v`; its front is where u × v points.
fn plate(o: [f64; 3], u: [f64; 3], v: [f64; 3]) -> [DVec3; 4] {
    let [o, u, v] = [o, u, v].map(DVec3::from);
    [o, o + u, o + u + v, o + v]
}

/// Face `axis` (and `far` side) of the unit cube seen from inside, cell (i, j) of n × n.
fn cube(axis: usize, far: bool, n: usize, i: usize, j: usize) -> [DVec3; 4] {
    let (mut o, mut u, mut v) = ([0.0; 3], [0.0; 3], [0.0; 3]);
    let (b, c) = if far { (axis + 2, axis + 1) } else { (axis + 1, axis + 2) };
    let cell = 1.0 / n as f64;
    (o[axis], o[b % 3], o[c % 3]) = (f64::from(far), i as f64 * cell, j as f64 * cell);
    (u[b % 3], v[c % 3]) = (cell, cell);
    plate(o, u, v)
}

fn cube_cells(n: usize) -> impl Iterator<Item = [DVec3; 4]> {
    (0..6 * n * n).map(move |k| cube(k % 3, k / 3 % 2 == 1, n, k / 6 / n, k / 6 % n))
}

// J. R. Howell, A catalog of radiation heat transfer configuration factors, C-11 and C-14.
fn parallel(x: f64, y: f64) -> f64 {
    let (p, q) = (1.0 + x * x, 1.0 + y * y);
    let sides = x * q.sqrt() * (x / q.sqrt()).atan() + y * p.sqrt() * (y / p.sqrt()).atan();
    let log = 0.5 * (p * q / (p + q - 1.0)).ln();
    2.0 / (PI * x * y) * (log + sides - x * x.atan() - y * y.atan())
}
fn perpendicular(w: f64, h: f64) -> f64 {
    let (p, q, z) = (1.0 + w * w, 1.0 + h * h, w * w + h * h);
    let power = |s: f64, t: f64| s * s * (s * s * (1.0 + z) / (t * z)).ln();
    let log = (p * q / (1.0 + z)).ln() + power(w, p) + power(h, q);
    let arc = |s: f64| s * (1.0 / s).atan();
    (arc(w) + arc(h) - arc(z.sqrt()) + 0.25 * log) / (PI * w)
}

#[test]
fn rectangles_match_the_catalogue() {
    for (a, b, c, right) in [
        (1.0, 1.0, 1.0, 0.19982489569838746),
        (1.0, 1.0, 0.1, 0.8269945223972565),
        (2.0, 1.0, 1.0, 0.2858753848507147),
        (1.0, 1.0, 5.0, 0.012403977313244396),
    ] {
        let floor = plate([0.0; 3], [a, 0.0, 0.0], [0.0, b, 0.0]);
        let ceiling = plate([0.0, 0.0, c], [0.0, b, 0.0], [a, 0.0, 0.0]);
        close(polygon_to_polygon(&floor, &ceiling), right, ROUNDING);
        close(parallel(a / c, b / c), right, ROUNDING);
    }
    for (l, w, h, right) in [
        (1.0, 1.0, 1.0, 0.20004377607540316),
        (1.0, 0.1, 1.0, 0.43251369400685863),
        (2.0, 1.0, 1.0, 0.24063600617696168),
        (1.0, 3.0, 2.0, 0.10779600955535174),
        (1.0, 1.0, 0.5, 0.1461866791057133),
    ] {
        let floor = plate([0.0; 3], [w, 0.0, 0.0], [0.0, l, 0.0]);
        let wall = plate([0.0; 3], [0.0, l, 0.0], [0.0, 0.0, h]);
        close(polygon_to_polygon(&floor, &wall), right, ROUNDING);
        close(perpendicular(w / l, h / l), right, ROUNDING);
    }
    // Edges neither parallel nor perpendicular, meeting at corners: a hinge of 45 degrees.
    let slope = 0.5_f64.sqrt();
    let floor = plate([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
    let lid = plate([0.0; 3], [0.0, 1.0, 0.0], [slope, 0.0, slope]);
    close(polygon_to_polygon(&floor, &lid), 0.48334769547887774, ROUNDING);
}

#[test]
fn a_point_sees_what_is_before_both_planes() {
    // Four corner rectangles of sides 1/4 at distance 1 (Howell B-3); eight terms of rounding.
    let window = plate([-0.25, -0.25, 1.0], [0.0, 0.5, 0.0], [0.5, 0.0, 0.0]);
    let part = 0.25 / 1.0625_f64.sqrt();
    let see = |normal, polygon: &[DVec3]| point_to_polygon(DVec3::ZERO, normal, polygon);
    close(see(DVec3::Z, &window), 4.0 / PI * part * part.atan(), 1e-15);
    assert_eq!(see(-DVec3::Z, &window), 0.0);
    // The side of a hemicube, and the same side extended below the horizon.
    for depth in [0.0, 1.0, 7.0] {
        let side = plate([1.0, -1.0, -depth], [0.0, 0.0, 1.0 + depth], [0.0, 2.0, 0.0]);
        close(see(DVec3::Z, &side), 0.11146839400510702, 1e-15);
        assert_eq!(see(DVec3::Z, &from_fn::<_, 4, _>(|i| side[3 - i])), 0.0);
    }
    // On a corner, on an edge, inside, in the plane: seen edge on.
    for o in [[0.0; 3], [-0.5, 0.0, 0.0], [-0.5, -0.5, 0.0], [2.0, 2.0, 0.0]] {
        let floor = plate(o, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
        for normal in [DVec3::X, DVec3::Z, -DVec3::Z, DVec3::new(0.6, 0.0, -0.8)] {
            assert_eq!(see(normal, &floor), 0.0);
        }
    }
}

#[test]
fn closed_rooms_lose_nothing() {
    for (n, from) in [
        (1, cube(2, false, 1, 0, 0)),
        (4, cube(2, false, 4, 0, 0)),
        (4, cube(0, true, 4, 1, 2)),
        (1, plate([0.0; 3], [1e-4, 0.0, 0.0], [0.0, 1e-4, 0.0])),
    ] {
        let sum: f64 = cube_cells(n).map(|to| polygon_to_polygon(&from, &to)).sum();
        close(sum, 1.0, ROUNDING);
        let back: [DVec3; 4] = from_fn(|i| from[3 - i]);
        assert!(cube_cells(n).all(|to| polygon_to_polygon(&back, &to) == 0.0));
    }
}

#[test]
fn crossing_planes_match_brute_force() {
    // The lid's plane 3.98 x − 0.2 y + z = 3.67 cuts the floor near x = 1; the lid dips below it.
    let floor = plate([0.0; 3], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
    let lid = plate([1.5, 1.5, -2.0], [0.0, 1.0, 0.2], [-1.0, 0.1, 4.0]);
    // Midpoint sums over the part of the floor in front of the lid, from the cut on to x = 2:
    // errors fall as n⁻², so that half the number of steps differs by three times the error.
    let midpoint = |n: u32| -> f64 {
        let step = |i: u32| (f64::from(i) + 0.5) / f64::from(n);
        let row = |y: f64| -> f64 {
            let cut = (3.67 + 0.2 * y) / 3.98;
            let see = |x| point_to_polygon(DVec3::new(x, y, 0.0), DVec3::Z, &lid);
            (2.0 - cut) * (0..n).map(|i| see(cut + (2.0 - cut) * step(i))).sum::<f64>()
        };
        (0..n).map(|i| row(step(i))).sum::<f64>() / f64::from(2 * n * n)
    };
    let (coarse, fine) = (midpoint(50), midpoint(100));
    assert!((coarse - fine).abs() < 1e-6);
    close(polygon_to_polygon(&floor, &lid), fine, (coarse - fine).abs() / 2.0);
}

#[test]
fn reciprocal_additive_and_free_of_scale() {
    let small = [[0.3, 0.2, 0.0], [0.5, 0.25, 0.1], [0.35, 0.6, -0.05]].map(DVec3::from);
    let large = [[2.0, 0.0, 1.0], [0.3, 0.2, 0.0], [0.0, 1.5, 1.5]].map(DVec3::from);
    let (there, back) = (polygon_to_polygon(&small, &large), polygon_to_polygon(&large, &small));
    assert!(there > 0.01);
    let flow = there * polygon_area(&small);
    close(flow, back * polygon_area(&large), ROUNDING * flow);
    // Cut at the intersection with an edge of the other, off any corner.
    let middle = large[1].lerp(large[2], 0.4);
    let parts = [[large[0], large[1], middle], [large[0], middle, large[2]]];
    close(parts.map(|to| polygon_to_polygon(&small, &to)).iter().sum(), there, ROUNDING);
    // A diamond a thousandth under a square, each one's edges crossing the other's.
    let diamond = plate([0.5, -0.3, -1e-3], [0.8, 0.8, 0.0], [-0.8, 0.8, 0.0]);
    let square = |x, w| plate([x, 0.0, 0.0], [0.0, 1.0, 0.0], [w, 0.0, 0.0]);
    let parts = [(0.0, 0.3), (0.3, 0.7)].map(|(x, w)| polygon_to_polygon(&diamond, &square(x, w)));
    close(parts.iter().sum(), polygon_to_polygon(&diamond, &square(0.0, 1.0)), ROUNDING);
    for scale in [1e-9, 1e9] {
        let [small, large] = [small, large].map(|face| face.map(|corner| corner * scale));
        close(polygon_to_polygon(&small, &large), there, ROUNDING * there);
        let (corner, up) = (small[2] - scale * DVec3::Z, DVec3::new(0.6, 0.0, 0.8));
        let right = point_to_polygon(corner / scale, up, &large.map(|v| v / scale));
        close(point_to_polygon(corner, up, &large), right, ROUNDING);
    }
}

#[test]
fn far_pairs_follow_the_expansion() {
    // Unit squares facing at distance d, q = d⁻²: mean of d²/(πr⁴) over both, r² = d² + u² + v²,
    // u and v of density 1 − |u|: F = q/π (1 − 2/3 q + 17/30 q² − …), next term 0.56 q³.
    let floor = plate([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
    for d in [10.0, 25.0, 100.0, 1e3, 1e6] {
        let ceiling = plate([0.0, 0.0, d], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]);
        let q = 1.0 / (d * d);
        let right = q / PI * (1.0 - 2.0 / 3.0 * q + 17.0 / 30.0 * q * q);
        let error = right * (0.56 * q * q * q + ROUNDING);
        close(polygon_to_polygon(&floor, &ceiling), right, error);
    }
    // An element 1e7 off the centre along (2, 3, 6)/7: the next term is of the order of q.
    let middle = DVec3::new(2.0, 3.0, 6.0) / 7.0 * 1e7 + DVec3::new(0.5, 0.5, 0.0);
    let q = 1e-14;
    let found = point_to_polygon(middle, DVec3::new(0.6, 0.0, -0.8), &floor);
    let right = 6.0 / 7.0 * (0.8 * 6.0 / 7.0 - 0.6 * 2.0 / 7.0) * q / PI;
    close(found, right, ROUNDING * right);
}
