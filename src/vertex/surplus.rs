//! What lies between vertices: the light on an element is not linear, and how far it is from that
//! tells which elements to split, where new vertices can do without gathering, and what is left.

use std::collections::HashMap;

use glam::DVec2;

use super::adaptive::AdaptiveGather;
use super::gathering::{GatheredMesh, RefinementSettings};
use super::keys::{VertexKey, corners, middles};
use crate::error::Error;
use crate::scene::Rgb;

/// Of two elements, one half as long may be off by two to this power times as much: between equal
/// errors, which would cut contacts to dust, and equal errors times length.
const SMALL: f64 = 0.75;

/// Steps along an element's side at which it is looked for what shines unevenly on it.
const LATTICE: u32 = 4;

/// The middle of a parabola is off by twice its root mean square, or a little less.
const SEEN: f64 = 2.0;

/// So many times further off than others are elements where their surface ends.
const AT_END: f64 = 2.5;

/// Middles off by more than this share are at a jump, where a parabola says nothing.
const JUMP: f64 = 0.2;

/// Light over the parent of an element: at its corners, and in the middles of its sides, from the first
/// corner to the second and so on. W/m², and whether that is in the light.
struct QuadraticPatch {
    corners: [(Rgb, bool); 3],
    middles: [(Rgb, bool); 3],
}

impl QuadraticPatch {
    /// How far each middle is from the mean of its side's ends, W/m².
    fn bends(&self) -> [Rgb; 3] {
        let (c, m) = (&self.corners, &self.middles);
        [0, 1, 2].map(|k| m[k].0 - (c[k].0 + c[(k + 1) % 3].0) / 2.0)
    }

    /// The middles that are in the light, and how far they are from the mean of their side's ends.
    fn lit(&self) -> impl Iterator<Item = (Rgb, Rgb)> {
        let middles = self.middles.iter().zip(self.bends());
        middles.filter(|(m, _)| m.1).map(|(m, bend)| (m.0, bend))
    }

    /// Whether all is known, and none of it is at a jump.
    fn is_smooth(&self) -> bool {
        let bend = self.bends().iter().sum::<Rgb>();
        let middle = self.middles.iter().map(|m| m.0).sum::<Rgb>();
        self.corners.iter().chain(&self.middles).all(|v| v.1)
            && bend.length() < JUMP * middle.length()
    }

    /// What it says of the middles of child `k`'s sides: the shape functions of the six-node triangle.
    fn middles_of_child(&self, k: usize) -> [Rgb; 3] {
        let corner = |i: usize| self.corners[i].0;
        let middle = |i: usize, j: usize| self.middles[if (i + 1) % 3 == j { i } else { j }].0;
        [0, 1, 2].map(|side| {
            let (i, j) = (side, (side + 1) % 3);
            if k == i || k == j {
                // On a side of the parent, next to its corner k.
                let other = i + j - k;
                return corner(k) * 0.375 + middle(i, j) * 0.75 - corner(other) * 0.125;
            }
            // Half-way between two middles, those next to corner `apex` of the parent.
            let apex = if k == 3 { 3 - i - j } else { k };
            let (p, q) = ((apex + 1) % 3, (apex + 2) % 3);
            (middle(apex, p) + middle(apex, q)) / 2.0 + middle(p, q) / 4.0
                - (corner(p) + corner(q)) / 8.0
        })
    }
}

impl AdaptiveGather<'_> {
    /// The light over the parent of element `e`, if it has one with a vertex in the middle of all sides.
    fn parabola(&self, e: usize) -> Option<QuadraticPatch> {
        let node = self.mesh.element(e);
        let (t, cell) = (self.mesh.triangle(node), self.mesh.cell(node));
        let parent = cell.ancestor(cell.level.checked_sub(1)?);
        let find = |key: &VertexKey| {
            let v = self.vertices.find(key)? as usize;
            Some((self.reflected[v], !self.covered[v]))
        };
        let [a, b, c] = corners(&self.smooth, t, parent).each_ref().map(find);
        let [d, e, f] = middles(&self.smooth, t, parent)?.each_ref().map(find);
        Some(QuadraticPatch { corners: [a?, b?, c?], middles: [d?, e?, f?] })
    }

    /// How much the light on element `e` bends, in units of what is allowed; 0 where it is not to be
    /// split. An element without a parent is taken for bent where its corners differ by four times
    /// as much.
    pub(super) fn bend(&self, e: usize, settings: &RefinementSettings) -> f64 {
        let node = self.mesh.element(e);
        let size = self.mesh.longest_edge(node);
        if !self.splits(e) || size <= settings.smallest {
            return 0.0;
        }
        let emitted = self.mesh.material(node).exitance;
        let allowed = settings.tolerance * (self.largest / size).powf(SMALL);
        let off = |value: Rgb, other: Rgb| {
            let whole = (value + emitted).length().max(self.dim);
            if whole > 0.0 { (value - other).length() / whole / allowed } else { 0.0 }
        };
        let at = |v: u32| (self.reflected[v as usize], self.covered[v as usize]);
        let corners = self.vertices.corners[e].map(at);
        let pairs = [(0, 1), (1, 2), (2, 0)].map(|(k, l)| (corners[k], corners[l]));
        let step = |(a, b): ((Rgb, bool), (Rgb, bool))| off(a.0, b.0) / 4.0;
        match self.parabola(e) {
            Some(parabola) => {
                let bent = parabola.lit().map(|(at, bend)| off(at, at - bend)).fold(0.0, f64::max);
                // What a covered corner was given should be what its element has.
                let given = pairs.into_iter().filter(|(a, b)| a.1 != b.1);
                given.map(step).fold(bent, f64::max)
            }
            None => {
                let mean = corners.iter().map(|c| c.0).sum::<Rgb>() / 3.0;
                let hidden = off(mean, mean + Rgb::splat(self.hidden(e) / 3f64.sqrt()));
                let steps = pairs.into_iter().filter(|(a, b)| !(a.1 && b.1)).map(step);
                steps.fold(SEEN * hidden, f64::max)
            }
        }
    }

    /// How far what shines is from linear over element `e`, where it is known more finely than that:
    /// root mean square over a lattice, W/m².
    fn hidden(&self, e: usize) -> f64 {
        let node = self.mesh.element(e);
        let (t, sources) = (self.mesh.triangle(node), self.light.sources());
        let [a, b, c] = self.mesh.cell(node).corners().map(DVec2::from_array);
        let at = |p: DVec2| sources.reflected_at(t, p.x, p.y);
        let ends = [a, b, c].map(at);
        let mut squares = 0.0;
        for i in 0..=LATTICE {
            for j in 0..=LATTICE - i {
                let [u, v] = [i, j].map(|k| f64::from(k) / f64::from(LATTICE));
                let linear = ends[0] * (1.0 - u - v) + ends[1] * u + ends[2] * v;
                squares += at(a * (1.0 - u - v) + b * u + c * v).distance_squared(linear);
            }
        }
        (squares / f64::from((LATTICE + 1) * (LATTICE + 2) / 2)).sqrt()
    }

    /// What the vertices reflect, as others are to see it: raised or lowered so that the mean over
    /// an element is that of the parabola through its parent's corners and middles, not of the plane
    /// through its own corners. Light is brightest where it is convex, so planes lose some.
    pub(super) fn seen(&self) -> Vec<Rgb> {
        let mut sums = vec![(Rgb::ZERO, 0.0); self.reflected.len()];
        for (e, corners) in self.vertices.corners.iter().enumerate() {
            let area = self.mesh.area(self.mesh.element(e));
            let parabola = self.parabola(e).filter(QuadraticPatch::is_smooth);
            // Half the size bends a quarter as much.
            let bend = parabola.map_or(Rgb::ZERO, |p| p.bends().iter().sum::<Rgb>() / 12.0);
            for &v in corners {
                sums[v as usize].0 += bend * area;
                sums[v as usize].1 += area;
            }
        }
        let all = self.reflected.iter().zip(sums);
        all.map(|(&b, (bend, area))| (b + bend / area).max(Rgb::ZERO)).collect()
    }

    /// What was reached, with elements split that the parabola over their parent leaves by more than
    /// `settings` allow: new vertices lie on it, or on the mean of two, and do not gather.
    ///
    /// Also how far off each element may be, W/m²: more where its surface ends or something stands on
    /// it. There light goes as d ln d with the distance d, which halving does not make four times as
    /// straight, nor is it a parabola.
    pub fn curved(&self, settings: &RefinementSettings) -> Result<(GatheredMesh, Vec<f64>), Error> {
        let mut split: Vec<(f64, usize, QuadraticPatch)> = (0..self.mesh.element_count())
            .filter(|&e| self.splits(e))
            .filter_map(|e| {
                if self.mesh.longest_edge(self.mesh.element(e)) <= settings.smallest {
                    return None;
                }
                let parabola = self.parabola(e).filter(QuadraticPatch::is_smooth)?;
                let emitted = self.mesh.material(self.mesh.element(e)).exitance;
                let mean = parabola.corners.iter().map(|c| c.0).sum::<Rgb>() / 3.0;
                let whole = (mean + emitted).length().max(self.dim);
                let bent = parabola.bends().iter().map(|b| b.length()).fold(0.0, f64::max) / 4.0;
                (bent > settings.curve * whole).then_some((bent / whole, e, parabola))
            })
            .collect();
        split.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        split.truncate(settings.elements.saturating_sub(self.mesh.element_count()) / 3);
        split.sort_by_key(|s| s.1);
        let mut said: HashMap<VertexKey, (Rgb, f64)> = HashMap::new();
        for (_, e, parabola) in &split {
            let node = self.mesh.element(*e);
            let (t, cell) = (self.mesh.triangle(node), self.mesh.cell(node));
            let siblings = cell.ancestor(cell.level - 1).children();
            let own = siblings.iter().position(|c| *c == cell).expect("a child of its parent");
            let keys = middles(&self.smooth, t, cell).expect("an element that can be split");
            for (key, value) in keys.into_iter().zip(parabola.middles_of_child(own)) {
                let sum = said.entry(key).or_default();
                *sum = (sum.0 + value.max(Rgb::ZERO), sum.1 + 1.0);
            }
        }
        let split: Vec<usize> = split.into_iter().map(|s| s.1).collect();
        let mut out = self.clone();
        let (fresh, _) = out.split(&split)?;
        for v in fresh.into_iter().map(|v| v as usize) {
            if let Some((sum, count)) = said.get(&out.vertices.keys[v]) {
                out.reflected[v] = *sum / *count;
            }
        }
        let (ends, mut split) = (self.ends(), split.into_iter().peekable());
        let mut rest = Vec::with_capacity(out.mesh.element_count());
        for (e, corners) in self.vertices.corners.iter().enumerate() {
            let parts = if split.next_if_eq(&e).is_some() { 4 } else { 1 };
            let rest_of = match corners.iter().any(|&v| ends[v as usize]) {
                true => AT_END * self.rest(e, false),
                false => self.rest(e, parts > 1),
            };
            rest.resize(rest.len() + parts, rest_of);
        }
        Ok((out.reached(), rest))
    }

    /// How far off an element may be by what is known of it, W/m²: a quarter of how far the middles of
    /// its parent were, and half of that where the parabola is followed.
    fn rest(&self, e: usize, followed: bool) -> f64 {
        let middles =
            |p: QuadraticPatch| p.lit().map(|(_, bend)| bend.length()).fold(0.0, f64::max);
        let known = self.parabola(e).map_or_else(|| self.hidden(e), |p| middles(p) / 4.0);
        if followed { known / 2.0 } else { known }
    }

    /// Whether each vertex lies where its surface ends, or next to what is covered.
    fn ends(&self) -> Vec<bool> {
        let mut ends = self.covered.clone();
        for corners in &self.vertices.corners {
            if corners.iter().any(|&v| self.covered[v as usize]) {
                corners.iter().for_each(|&v| ends[v as usize] = true);
            }
        }
        let mut sides: HashMap<(u32, u32), u32> = HashMap::new();
        for corners in &self.vertices.corners {
            for k in 0..3 {
                let (a, b) = (corners[k], corners[(k + 1) % 3]);
                *sides.entry((a.min(b), a.max(b))).or_default() += 1;
            }
        }
        // Where elements are unequal, inner sides are run once too; those join no two triangles.
        let outer = |v: u32| match self.vertices.keys[v as usize] {
            VertexKey::Inside { .. } => false,
            VertexKey::Side { id, .. } => !self.joined.contains(&id),
            VertexKey::Corner(_) => true,
        };
        for ((a, b), count) in sides {
            if count == 1 && outer(a) && outer(b) {
                ends[a as usize] = true;
                ends[b as usize] = true;
            }
        }
        ends
    }
}
