//! Closed forms: the truth in every test.
//!
//! Form factors of unoccluded plane polygons, diffuse on both ends. A polygon is a slice of
//! corners, planar, convex and counter-clockwise seen from its front; only its front takes part.
//! Lengths are in any one unit, form factors are dimensionless fractions in [0, 1], and everything
//! is invariant under scaling and moving both ends together, as long as squares of areas neither
//! overflow nor underflow. A polygon without area neither gives nor receives.

use std::f64::consts::{FRAC_PI_4, PI, TAU};
use std::sync::LazyLock;

use glam::DVec3;

/// A height over a plane below this share of the extent at hand is contact, not a gap. Corners
/// carry rounding of about 1e-16 of their coordinates; what is lost is 1e-13 of a form factor.
const CONTACT: f64 = 1e-13;

/// Edges whose angle differs from 0 or 90 degrees by less (radians) are parallel or perpendicular.
const ANGLE: f64 = 1e-14;

/// Cubature over a face needs a gap of at least so many of its radii: see [`rule`].
const FAR: f64 = 8.0;

/// Lambert's formula loses the ratio of distance to size in digits; beyond so many radii, cubature
/// with no cancellation replaces it. At the switch the relative error is 64 × 2e-16 × a few.
const VERY_FAR: f64 = 64.0;

/// Area of a planar polygon, in squares of its unit of length.
///
/// Rounding only: relative error about 1e-16 times the ratio of length to width.
pub fn polygon_area(polygon: &[DVec3]) -> f64 {
    area_vector(polygon).length()
}

/// Form factor from a surface element at `point` with unit `normal` to the front of `polygon`: the
/// share of the light leaving the element that arrives there.
///
/// What lies below the element's horizon is clipped off. The factor is 0 where the element is
/// behind the polygon's plane, and also in that plane (within 1e-13 of its distance to the farthest
/// corner), even on the polygon's own rim: from there it is seen edge on.
///
/// Lambert's formula, F = 1/(2π) Σ Γᵢ·n, Γᵢ as long as the angle that edge i subtends and
/// perpendicular to the plane of edge and point (J. H. Lambert, Photometria, 1760; D. R. Baum,
/// H. E. Rushmeier, J. M. Winget, "Improving radiosity solutions through the use of analytically
/// determined form-factors", SIGGRAPH 1989). Beyond 64 radii of the polygon, Gauss cubature of
/// cos θ cos θ′ / (π r²). Relative error below 1e-12 away from grazing angles, at any distance;
/// absolute below 1e-14 always.
pub fn point_to_polygon(point: DVec3, normal: DVec3, polygon: &[DVec3]) -> f64 {
    let facing = area_vector(polygon).normalize_or_zero();
    let Some(&corner) = polygon.first() else { return 0.0 };
    if facing.dot(point - corner) <= CONTACT * extent(polygon, point) {
        return 0.0;
    }
    Face::new(clip(polygon, point, normal), facing)
        .map_or(0.0, |face| face.seen_from(point, normal).clamp(0.0, 1.0))
}

/// Form factor between two unoccluded polygons, averaged over the whole area of `from`: the share
/// of the light leaving `from` that arrives at the front of `to`.
///
/// Parts of each behind the other's plane see nothing and are clipped off first. This is exact:
/// x in one sees y in the other if and only if y is before the plane of x, the same for all x, and
/// x before the plane of y. Touching polygons are fine; coplanar ones exchange nothing.
///
/// Contour integral A₁F₁₂ = 1/(2π) ∮∮ ln r dx·dx′ (E. M. Sparrow, "A new and simpler formulation
/// for radiative angle factors", J. Heat Transfer 85, 1963; P. Schröder, P. Hanrahan, "On the form
/// factor between two polygons", SIGGRAPH 1993, for the non-elementary closed form): closed over
/// pairs of parallel edges, else closed over one edge and tanh–sinh quadrature (H. Takahasi,
/// M. Mori, Publ. RIMS 9, 1974) over the other. Far and lopsided pairs: see `exchange`.
///
/// Checked against 26-digit contour integrals and by cutting random pairs in two: apart (by up to
/// 1e6 sizes), touching, of sizes up to 1e6 apart, crossing each other's planes. The absolute error
/// of the smaller one's factor is below 1e-13, mostly 1e-15; the relative error is below 1e-12 at
/// any distance, save for pairs nearly edge on, which keep the absolute one alone. Slivers lose
/// length / width in digits: about 1e-16 × length / width, absolute. Reciprocity A₁F₁₂ = A₂F₂₁
/// holds as closely.
pub fn polygon_to_polygon(from: &[DVec3], to: &[DVec3]) -> f64 {
    let (Some(&at_from), Some(&at_to)) = (from.first(), to.first()) else { return 0.0 };
    let from_normal = area_vector(from).normalize_or_zero();
    let to_normal = area_vector(to).normalize_or_zero();
    let giver = Face::new(clip(from, at_to, to_normal), from_normal);
    let taker = Face::new(clip(to, at_from, from_normal), to_normal);
    match (giver, taker) {
        (Some(p), Some(q)) => (exchange(&p, &q) / polygon_area(from)).clamp(0.0, 1.0),
        _ => 0.0,
    }
}

/// A convex plane polygon with its unit normal and a sphere around it.
struct Face {
    corners: Vec<DVec3>,
    normal: DVec3,
    centre: DVec3,
    radius: f64,
}

impl Face {
    /// Nothing if there is no area to speak of.
    fn new(corners: Vec<DVec3>, normal: DVec3) -> Option<Face> {
        let centre = corners.iter().sum::<DVec3>() / corners.len() as f64;
        let radius = extent(&corners, centre);
        (corners.len() > 2 && radius > 0.0).then_some(Face { corners, normal, centre, radius })
    }

    /// Form factor from an element that has all of this face before it and is before it.
    fn seen_from(&self, point: DVec3, normal: DVec3) -> f64 {
        let gap = point.distance(self.centre) - self.radius;
        if gap < VERY_FAR * self.radius {
            return lambert(point, normal, &self.corners);
        }
        self.integrate(gap, |y| {
            let ray = y - point;
            let square = ray.length_squared();
            -normal.dot(ray) * self.normal.dot(ray) / (PI * square * square)
        })
    }

    /// Surface integral of `f`, smooth but for singularities `gap` away from the face: a Gauss
    /// product rule on each triangle of a fan, collapsed towards the first corner.
    fn integrate(&self, gap: f64, f: impl Fn(DVec3) -> f64) -> f64 {
        let (nodes, weights) = rule(gap / self.radius);
        let rule = || nodes.iter().zip(weights);
        let mut sum = 0.0;
        for pair in self.corners[1..].windows(2) {
            let (a, b, c) = (self.corners[0], pair[0], pair[1]);
            let jacobian = (b - a).cross(c - a).length();
            for (&u, along) in rule() {
                for (&v, across) in rule() {
                    sum += along * across * u * jacobian * f(a + u * ((b - a) + v * (c - b)));
                }
            }
        }
        sum
    }

    /// Both parts of a cut through the centre, square to the longest edge.
    fn halves(&self) -> impl Iterator<Item = Face> {
        let longest = edges(&self.corners).max_by(|a, b| a.length.total_cmp(&b.length));
        let axis = longest.map_or(DVec3::ZERO, |edge| edge.direction);
        let half = |axis| Face::new(clip(&self.corners, self.centre, axis), self.normal);
        [half(axis), half(-axis)].into_iter().flatten()
    }
}

/// An edge of a polygon, its direction of unit length.
#[derive(Clone, Copy)]
struct Edge {
    start: DVec3,
    end: DVec3,
    direction: DVec3,
    length: f64,
}

/// The edges of a polygon in order, less those without length.
fn edges(polygon: &[DVec3]) -> impl Iterator<Item = Edge> {
    let next = polygon.iter().cycle().skip(1);
    polygon.iter().zip(next).filter_map(|(&start, &end)| {
        let length = start.distance(end);
        (length > 0.0).then(|| Edge { start, end, direction: (end - start) / length, length })
    })
}

/// Normal towards the front, as long as the area is large.
pub(crate) fn area_vector(polygon: &[DVec3]) -> DVec3 {
    let Some((&apex, rest)) = polygon.split_first() else { return DVec3::ZERO };
    rest.windows(2).map(|pair| 0.5 * (pair[0] - apex).cross(pair[1] - apex)).sum()
}

/// Distance from `origin` to the farthest corner.
fn extent(polygon: &[DVec3], origin: DVec3) -> f64 {
    polygon.iter().map(|corner| corner.distance(origin)).fold(0.0, f64::max)
}

/// What of a convex polygon is before the plane through `origin` with unit `normal`; corners in
/// contact with the plane stay, a polygon with none beyond vanishes (I. E. Sutherland,
/// G. W. Hodgman, "Reentrant polygon clipping", CACM 17, 1974).
pub(crate) fn clip(polygon: &[DVec3], origin: DVec3, normal: DVec3) -> Vec<DVec3> {
    let contact = CONTACT * extent(polygon, origin);
    let height = |corner: DVec3| {
        let height = normal.dot(corner - origin);
        if height.abs() <= contact { 0.0 } else { height }
    };
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    let mut highest = 0.0_f64;
    for (i, &a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let (above, next) = (height(a), height(b));
        if above >= 0.0 {
            kept.push(a);
        }
        if above * next < 0.0 {
            kept.push(a + (b - a) * (above / (above - next)));
        }
        highest = highest.max(above);
    }
    if highest > 0.0 { kept } else { Vec::new() }
}

/// Lambert's formula, for a polygon that is all above the horizon.
pub(crate) fn lambert(point: DVec3, normal: DVec3, corners: &[DVec3]) -> f64 {
    let along_normal = |edge: Edge| {
        let (a, b) = (edge.start - point, edge.end - point);
        let across = a.cross(b - a);
        let sine = across.length();
        if sine > 0.0 { sine.atan2(a.dot(b)) * normal.dot(across) / sine } else { 0.0 }
    };
    -edges(corners).map(along_normal).sum::<f64>() / TAU
}

/// A₁F₁₂ of two faces that are all before one another.
///
/// The contour integral adds terms of up to L₁L₂ (edge lengths) to a sum of about A₁A₂/d², so it
/// loses a factor d²/(L₁L₂), and relative to A₁ a factor L₂/L₁. Hence it is kept for pairs near one
/// another and of like size, where this is below 100. Apart from these, a face at a distance of
/// [`FAR`] times its radius is integrated over by cubature, where nothing cancels; and of two faces
/// that are too unlike, the larger is halved until each part is one or the other.
fn exchange(p: &Face, q: &Face) -> f64 {
    let (small, large) = if p.radius <= q.radius { (p, q) } else { (q, p) };
    let gap = p.centre.distance(q.centre) - p.radius - q.radius;
    if gap >= FAR * small.radius {
        small.integrate(gap, |x| large.seen_from(x, small.normal))
    } else if large.radius > FAR * small.radius {
        large.halves().map(|half| exchange(small, &half)).sum()
    } else {
        contour(p, q)
    }
}

/// A₁F₁₂ as a double contour integral, in units of the size of the pair: a constant added to ln r
/// adds nothing to the whole, and in these units the logarithms themselves are small.
fn contour(p: &Face, q: &Face) -> f64 {
    let unit = p.radius + q.radius + p.centre.distance(q.centre);
    let outline = |face: &Face| -> Vec<DVec3> {
        face.corners.iter().map(|corner| (corner - p.centre) / unit).collect()
    };
    let (p, q) = (outline(p), outline(q));
    let pairs = edges(&p).flat_map(|a| edges(&q).map(move |b| edge_pair(a, b)));
    unit * unit * pairs.sum::<f64>() / TAU
}

/// ∫∫ (1 + ln r) dx·dx′ over two edges. The 1 drops out of the whole and shortens the terms.
fn edge_pair(a: Edge, b: Edge) -> f64 {
    let (cosine, sine) = (a.direction.dot(b.direction), a.direction.cross(b.direction).length());
    if cosine.abs() <= ANGLE {
        0.0
    } else if sine <= ANGLE {
        parallel_edges(a, b)
    } else if a.length <= b.length {
        cosine * skew_edges(a, b)
    } else {
        cosine * skew_edges(b, a)
    }
}

/// [`edge_pair`] for parallel edges: second differences of the twofold antiderivative of 1 + ln r.
fn parallel_edges(a: Edge, b: Edge) -> f64 {
    let apart = (b.start - a.start).cross(a.direction).length();
    let twofold = |from: DVec3, to: DVec3| {
        let along = (to - from).dot(a.direction);
        let (t, h) = (along * along, apart * apart);
        if t + h == 0.0 {
            return 0.0;
        }
        0.25 * ((t - h) * (t + h).ln() - t) + apart * along * along.atan2(apart)
    };
    twofold(a.start, b.end) - twofold(a.end, b.end) - twofold(a.start, b.start)
        + twofold(a.end, b.start)
}

/// ∫∫ (1 + ln r) dt dt′ over two edges that are not parallel: along `b` in closed form, along `a`
/// by quadrature, cut where the integrand is singular or nearly so: beside the ends of `b`, and
/// where the lines come closest. Such a place is `off` the edge by some imaginary length, and cut
/// at only if that is less than the edge's length; it then sits at the ends of intervals, which
/// tanh–sinh quadrature bears.
fn skew_edges(a: Edge, b: Edge) -> f64 {
    let beside = |end: DVec3| {
        let ray = end - a.start;
        (ray.dot(a.direction), ray.cross(a.direction).length())
    };
    let across = a.direction.cross(b.direction);
    let (ray, sine_square) = (b.start - a.start, across.length_squared());
    let nearest =
        (ray.cross(b.direction).dot(across) / sine_square, ray.dot(across).abs() / sine_square);
    let mut cuts = vec![0.0, a.length];
    for (along, off) in [beside(b.start), beside(b.end), nearest] {
        if 0.0 < along && along < a.length && off < a.length {
            cuts.push(along);
        }
    }
    cuts.sort_by(f64::total_cmp);
    let inner = |t: f64| log_integral(a.start + t * a.direction, b);
    cuts.windows(2).map(|cut| tanh_sinh(cut[0], cut[1], inner)).sum()
}

/// ∫ (1 + ln r) dt′ over the edge, r the distance from `point`.
fn log_integral(point: DVec3, edge: Edge) -> f64 {
    let (a, b) = (point - edge.start, point - edge.end);
    let apart = a.cross(edge.direction).length();
    let part = |t: f64, square: f64| if square > 0.0 { 0.5 * t * square.ln() } else { 0.0 };
    part(a.dot(edge.direction), a.length_squared())
        - part(b.dot(edge.direction), b.length_squared())
        + apart * (apart * edge.length).atan2(a.dot(b))
}

/// Nodes of the tanh–sinh rule on [0, 1], nearer half: (distance from the end, weight), finer and
/// finer; level k adds those that a step of 1/2^(k+1) has more than twice that step.
static TANH_SINH: LazyLock<Vec<Vec<(f64, f64)>>> = LazyLock::new(|| {
    let node = |s: f64| {
        let near = 1.0 / (1.0 + (PI * s.sinh()).exp());
        (near, PI * s.cosh() * near * (1.0 - near))
    };
    let level = |k: u32| {
        let step = 0.5_f64.powi(k as i32 + 1);
        let (first, stride) = if k == 0 { (1, 1) } else { (1, 2) };
        let steps = (first..).step_by(stride).map(move |i: u32| node(f64::from(i) * step));
        steps.take_while(|node| node.1 > 1e-18).collect()
    };
    (0..7).map(level).collect()
});

/// ∫ f over [from, to], f analytic inside. Errors about square with each level, so that levels
/// alike in 13 digits leave rounding only.
fn tanh_sinh(from: f64, to: f64, f: impl Fn(f64) -> f64) -> f64 {
    let length = to - from;
    let mut sum = FRAC_PI_4 * f(from + 0.5 * length);
    let (mut step, mut value) = (1.0, f64::INFINITY);
    for level in TANH_SINH.iter() {
        let both = |near: f64| f(from + near * length) + f(to - near * length);
        sum += level.iter().map(|&(near, weight)| weight * both(near)).sum::<f64>();
        step *= 0.5;
        let last = std::mem::replace(&mut value, step * sum);
        if (value - last).abs() <= 1e-13 {
            break;
        }
    }
    length * value
}

/// Gauss–Legendre rules on [0, 1].
const NODES_4: [f64; 4] =
    [0.06943184420297371, 0.33000947820757187, 0.6699905217924281, 0.9305681557970263];
const WEIGHTS_4: [f64; 4] =
    [0.17392742256872692, 0.32607257743127305, 0.32607257743127305, 0.17392742256872692];
const NODES_6: [f64; 6] = [
    0.03376524289842399,
    0.16939530676686773,
    0.38069040695840156,
    0.6193095930415985,
    0.8306046932331322,
    0.966234757101576,
];
const WEIGHTS_6: [f64; 6] = [
    0.08566224618958518,
    0.1803807865240693,
    0.23395696728634552,
    0.23395696728634552,
    0.1803807865240693,
    0.08566224618958518,
];

/// The Gauss rule, (nodes, weights), that suffices for an integrand singular `ratio` radii off.
///
/// On an interval of half length 1 with singularities a distance z off, n nodes err by about
/// ρ^(−2n), ρ = z + √(z² + 1): 16^(−12) and 128^(−8), below 4e-15.
fn rule(ratio: f64) -> (&'static [f64], &'static [f64]) {
    if ratio < 64.0 { (&NODES_6, &WEIGHTS_6) } else { (&NODES_4, &WEIGHTS_4) }
}

#[cfg(test)]
mod tests {
    use std::array::from_fn;

    use super::*;

    /// What rounding may do to a contour integral of two rectangles: 16 pairs of edges, four terms
    /// of at most about 1 each in squares of the pair's size S, each rounded to 2e-16, over 2πA₁;
    /// S² is up to 45 A₁ here: 16 · 4 · 2e-16 · 45 / 2π = 9e-14.
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
        // The side of a hemicube, and the same side drawn on below the horizon.
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
        // Midpoint sums over the part of the floor before the lid, from the cut on to x = 2: errors
        // fall as n⁻², so that half as many steps differ by three times the error.
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
        let (there, back) =
            (polygon_to_polygon(&small, &large), polygon_to_polygon(&large, &small));
        assert!(there > 0.01);
        let flow = there * polygon_area(&small);
        close(flow, back * polygon_area(&large), ROUNDING * flow);
        // Cut where an edge of the other one's meets it, off any corner.
        let middle = large[1].lerp(large[2], 0.4);
        let parts = [[large[0], large[1], middle], [large[0], middle, large[2]]];
        close(parts.map(|to| polygon_to_polygon(&small, &to)).iter().sum(), there, ROUNDING);
        // A diamond a thousandth under a square, each one's edges crossing the other's.
        let diamond = plate([0.5, -0.3, -1e-3], [0.8, 0.8, 0.0], [-0.8, 0.8, 0.0]);
        let square = |x, w| plate([x, 0.0, 0.0], [0.0, 1.0, 0.0], [w, 0.0, 0.0]);
        let parts =
            [(0.0, 0.3), (0.3, 0.7)].map(|(x, w)| polygon_to_polygon(&diamond, &square(x, w)));
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
}
