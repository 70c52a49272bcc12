//! The state of gathering: a mesh that grows finer, and what its vertices reflect.

use std::borrow::Cow;
use std::collections::{HashMap, HashSet};

use glam::{DMat3, DVec2, DVec3};

use super::VertexRadiosity;
use super::gathering::{GatherProgress, GatheredRadiosity, Gathering};
use super::places::Stands;
use super::seams::Seams;
use super::vertices::{Key, Vertices, corners, middles};
use crate::error::Error;
use crate::gather::{Gather, Place};
use crate::mesh::{MAX_DEPTH, Mesh, Smooth};
use crate::scene::Rgb;
use crate::solve::{Go, Stop};

pub(crate) struct Refined<'a> {
    /// What shines on the vertices.
    light: Cow<'a, GatheredRadiosity>,
    mesh: Mesh,
    smooth: Smooth,
    vertices: Vertices,
    /// Reflected radiosity at the vertices, W/m².
    reflected: Vec<Rgb>,
    /// Whether a vertex lies under something that touches its surface.
    covered: Vec<bool>,
    /// How far the last sweep was from what was known before it, relative.
    change: f64,
    /// Times that what was reached has shone.
    sweep: u32,
    /// Times that elements have been split.
    level: u32,
    /// Places at which light was gathered.
    gathers: u64,
    /// Radiosity that is as good as none, W/m².
    dim: f64,
    /// Longest edge of the elements to begin with, scene unit.
    largest: f64,
    /// Sides across which a smooth surface goes on.
    joined: HashSet<u32>,
}

/// Vertices that gather at once: progress is told of after each batch.
const BATCH: usize = 256;

/// Where less than this share of the mean is reflected, errors are weighed against the share: the
/// insides of gaps are not worth most of the elements.
const DIM: f64 = 0.05;

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

impl<'a> Refined<'a> {
    /// Starts on `mesh` from what `light`, of the same scene, has at its vertices.
    pub fn new(mesh: Mesh, light: &'a GatheredRadiosity) -> Refined<'a> {
        let smooth = Smooth::new(mesh.scene());
        let vertices = Vertices::new(&mesh, &smooth);
        let sources = light.sources();
        let at = |&(t, [u, v]): &(usize, [f64; 2])| sources.reflected_at(t, u, v);
        let reflected: Vec<Rgb> = vertices.places.iter().map(at).collect();
        let (mut flux, mut area) = (0.0, 0.0);
        for (e, corners) in light.corners.iter().enumerate() {
            let size = light.mesh.area(light.mesh.element(e));
            let mean = corners.iter().map(|&v| light.reflected[v as usize]).sum::<Rgb>() / 3.0;
            (flux, area) = (flux + mean.length() * size, area + size);
        }
        let edge = |e| mesh.longest_edge(mesh.element(e));
        let largest = (0..mesh.element_count()).map(edge).fold(0.0, f64::max);
        let (covered, dim) = (vec![false; reflected.len()], DIM * flux / area);
        let joined = smooth.joins().map(|[(t, k), _]| smooth.sides[t][k].id).collect();
        let (light, sweep, level, gathers) = (Cow::Borrowed(light), 0, 0, 0);
        Refined {
            light,
            mesh,
            smooth,
            vertices,
            reflected,
            covered,
            change: 0.0,
            sweep,
            level,
            gathers,
            dim,
            largest,
            joined,
        }
    }

    /// What was reached.
    pub fn reached(&self) -> GatheredRadiosity {
        GatheredRadiosity {
            mesh: self.mesh.clone(),
            surface: self.surface(),
            corners: self.vertices.corners.clone(),
            reflected: self.seen(),
            gathers: self.gathers,
            change: self.change,
            stop: Stop::Converged,
        }
    }

    /// Lets what was reached shine from now on.
    pub fn shine(&mut self) {
        self.light = Cow::Owned(self.reached());
        self.sweep += 1;
    }

    /// Root mean square over the elements of how far their vertices are from `before`, relative.
    fn distance(&self, before: &[Rgb]) -> f64 {
        let (mut off, mut all) = (0.0, 0.0);
        for (e, corners) in self.vertices.corners.iter().enumerate() {
            let area = self.mesh.area(self.mesh.element(e));
            for &v in corners {
                off += area * (self.reflected[v as usize] - before[v as usize]).length_squared();
                all += area * self.reflected[v as usize].length_squared();
            }
        }
        if all > 0.0 { (off / all).sqrt() } else { 0.0 }
    }

    /// Lets the vertices `fresh` gather.
    fn gather(
        &mut self,
        fresh: &[u32],
        gather: &mut dyn Gather,
        progress: &mut dyn FnMut(&GatherProgress) -> Go,
    ) -> Result<Go, Error> {
        let stands = Stands::new(&self.mesh, &self.vertices);
        // What reflects nothing need not look.
        let reflects = |&v: &u32| stands.reflectance(v) != Rgb::ZERO;
        let mut left: Vec<u32> = fresh.iter().copied().filter(reflects).collect();
        let sources = self.light.sources();
        let (of, mut gathered) = (left.len(), 0);
        for attempt in 0.. {
            let mut again = vec![];
            for batch in left.chunks(BATCH) {
                let places: Vec<Place> = batch.iter().map(|&v| stands.place(v, attempt)).collect();
                self.gathers += places.len() as u64;
                for (&v, found) in batch.iter().zip(gather.gather(&sources, &places)?) {
                    let covered = stands.is_covered(v, &found);
                    self.covered[v as usize] = covered;
                    if covered && stands.has_more(v, attempt) {
                        again.push(v);
                    } else {
                        gathered += 1;
                    }
                    if !covered {
                        self.reflected[v as usize] = stands.reflectance(v) * found.irradiance;
                    }
                }
                let elements = self.mesh.element_count();
                let (sweep, level) = (self.sweep, self.level);
                if progress(&GatherProgress { sweep, level, elements, gathered, of }).is_break() {
                    return Ok(Go::Break(()));
                }
            }
            left = again;
            if left.is_empty() {
                break;
            }
        }
        self.uncover();
        Ok(Go::Continue(()))
    }

    /// Lets all vertices gather what shines, then splits and gathers on.
    pub fn sweep(
        &mut self,
        settings: &Gathering,
        gather: &mut dyn Gather,
        progress: &mut dyn FnMut(&GatherProgress) -> Go,
    ) -> Result<Stop, Error> {
        let (before, all) = (self.reflected.clone(), 0..self.reflected.len() as u32);
        if self.gather(&all.collect::<Vec<_>>(), gather, progress)?.is_break() {
            return Ok(Stop::Cancelled);
        }
        self.change = self.distance(&before);
        self.refine(settings, gather, progress)
    }

    /// Splits elements where the light bends by more than `settings` allow, and lets the new vertices
    /// gather, until it does nowhere.
    pub fn refine(
        &mut self,
        settings: &Gathering,
        gather: &mut dyn Gather,
        progress: &mut dyn FnMut(&GatherProgress) -> Go,
    ) -> Result<Stop, Error> {
        let mut young: Vec<usize> = (0..self.mesh.element_count()).collect();
        let mut crowded = false;
        loop {
            let room = settings.elements.saturating_sub(self.mesh.element_count()) / 3;
            let mut bent: Vec<(f64, usize)> = if self.level < settings.everywhere {
                young.iter().map(|&e| (1.0, e)).filter(|b| self.splits(b.1)).collect()
            } else {
                young.iter().map(|&e| (self.bend(e, settings), e)).filter(|b| b.0 > 1.0).collect()
            };
            if bent.is_empty() {
                return Ok(if crowded { Stop::Elements } else { Stop::Converged });
            }
            if bent.len() > room {
                crowded = true;
                bent.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
                bent.truncate(room);
            }
            if bent.is_empty() {
                return Ok(Stop::Elements);
            }
            let mut split: Vec<usize> = bent.into_iter().map(|b| b.1).collect();
            split.sort_unstable();
            let fresh;
            (fresh, young) = self.split(&split)?;
            if self.gather(&fresh, gather, progress)?.is_break() {
                return Ok(Stop::Cancelled);
            }
        }
    }

    /// What the vertices reflect, as others are to see it: raised or lowered so that the mean over
    /// an element is that of the parabola through its parent's corners and middles, not of the plane
    /// through its own corners. Light is brightest where it is convex, so planes lose some.
    fn seen(&self) -> Vec<Rgb> {
        let mut sums = vec![(Rgb::ZERO, 0.0); self.reflected.len()];
        for (e, corners) in self.vertices.corners.iter().enumerate() {
            let area = self.mesh.area(self.mesh.element(e));
            let bend = self.sides(e).map_or(Rgb::ZERO, |sides| {
                let mean = |f: fn(&Side) -> Rgb| sides.iter().map(f).sum::<Rgb>() / 3.0;
                let (bend, middle) = (mean(Side::bend), mean(|s| s.middle));
                let smooth = sides.iter().all(|s| s.known);
                let smooth = smooth && bend.length() < JUMP * middle.length();
                // Half the size bends a quarter as much.
                if smooth { bend / 4.0 } else { Rgb::ZERO }
            });
            for &v in corners {
                sums[v as usize].0 += bend * area;
                sums[v as usize].1 += area;
            }
        }
        let all = self.reflected.iter().zip(sums);
        all.map(|(&b, (bend, area))| (b + bend / area).max(Rgb::ZERO)).collect()
    }

    /// The sides of element `e`'s parent, if all three have a vertex in their middle.
    fn sides(&self, e: usize) -> Option<[Side; 3]> {
        let node = self.mesh.element(e);
        let (t, cell) = (self.mesh.triangle(node), self.mesh.cell(node));
        let parent = cell.ancestor(cell.level.checked_sub(1)?);
        let find = |key: &Key| self.vertices.find(key).map(|v| v as usize);
        let ends = corners(&self.smooth, t, parent).each_ref().map(find);
        let middles = middles(&self.smooth, t, parent)?.each_ref().map(find);
        let side = |k: usize| {
            let (a, m, b) = (ends[k]?, middles[k]?, ends[(k + 1) % 3]?);
            let known = ![a, m, b].iter().any(|&v| self.covered[v]);
            let [a, middle, b] = [a, m, b].map(|v| self.reflected[v]);
            Some(Side { mean: (a + b) / 2.0, middle, lit: !self.covered[m], known })
        };
        Some([side(0)?, side(1)?, side(2)?])
    }

    /// Whether element `e` can be split at all.
    fn splits(&self, e: usize) -> bool {
        let node = self.mesh.element(e);
        self.mesh.cell(node).level < MAX_DEPTH && self.mesh.material(node).reflectance != Rgb::ZERO
    }

    /// How much the light on element `e` bends, in units of what is allowed; 0 where it is not to be
    /// split. An element without a parent is taken for bent where its corners differ by four times
    /// as much.
    fn bend(&self, e: usize, settings: &Gathering) -> f64 {
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
        match self.sides(e) {
            Some(sides) => {
                let lit = sides.iter().filter(|s| s.lit);
                let bent = lit.map(|s| off(s.middle, s.mean)).fold(0.0, f64::max);
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

    /// How far off each element may be by what is known of it, W/m²: a quarter of how far the middles
    /// of its parent were, and more where its surface ends or something stands on it. There light
    /// goes as d ln d with the distance d, which halving does not make four times as straight.
    pub fn rest(&self) -> Vec<f64> {
        let ends = self.ends();
        let rest = |e: usize| {
            let known = match self.sides(e) {
                Some(sides) => {
                    let lit = sides.iter().filter(|s| s.lit);
                    lit.map(|s| s.bend().length()).fold(0.0, f64::max) / 4.0
                }
                None => self.hidden(e),
            };
            let at_end = self.vertices.corners[e].iter().any(|&v| ends[v as usize]);
            if at_end { known * AT_END } else { known }
        };
        (0..self.mesh.element_count()).map(rest).collect()
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
            Key::Inside { .. } => false,
            Key::Side { id, .. } => !self.joined.contains(&id),
            Key::Corner(_) => true,
        };
        for ((a, b), count) in sides {
            if count == 1 && outer(a) && outer(b) {
                ends[a as usize] = true;
                ends[b as usize] = true;
            }
        }
        ends
    }

    /// What shines on the vertices.
    pub fn light(&self) -> &GatheredRadiosity {
        &self.light
    }

    /// Splits `elements`, which ascend. Gives the vertices that are new, which have the mean of those
    /// that they lie between, and the elements that are.
    fn split(&mut self, elements: &[usize]) -> Result<(Vec<u32>, Vec<usize>), Error> {
        let finer = self.mesh.split(elements)?;
        self.level += 1;
        let vertices = Vertices::new(&finer, &self.smooth);
        let count = vertices.positions.len();
        let (mut reflected, mut covered) = (vec![Rgb::ZERO; count], vec![false; count]);
        let mut fresh = vec![];
        for (v, key) in vertices.keys.iter().enumerate() {
            match self.vertices.find(key) {
                Some(old) => {
                    reflected[v] = self.reflected[old as usize];
                    covered[v] = self.covered[old as usize];
                }
                None => fresh.push(v as u32),
            }
        }
        let is_new = |v: usize| self.vertices.find(&vertices.keys[v]).is_none();
        let mut young = vec![];
        for (k, &e) in elements.iter().enumerate() {
            // Each split before this one has put four elements in the place of one.
            young.extend(e + 3 * k..e + 3 * k + 4);
            let [a, b, c] = self.vertices.corners[e].map(|v| self.reflected[v as usize]);
            // The corners of the fourth part are the middles of the sides opposite a, b and c.
            let middles = vertices.corners[e + 3 * k + 3].map(|v| v as usize);
            for (m, mean) in middles.into_iter().zip([b + c, c + a, a + b]) {
                if is_new(m) {
                    reflected[m] = mean / 2.0;
                }
            }
        }
        (self.mesh, self.vertices) = (finer, vertices);
        (self.reflected, self.covered) = (reflected, covered);
        Ok((fresh, young))
    }

    /// Gives covered vertices what their neighbours in the light say, extrapolated along the slope
    /// that the light has there; the nearest first.
    fn uncover(&mut self) {
        let mut known: Vec<bool> = self.covered.iter().map(|c| !c).collect();
        if known.iter().all(|&k| k) {
            return;
        }
        let position = |v: u32| self.vertices.positions[v as usize];
        let slopes = self.slopes();
        for ring in 0..RINGS {
            let mut sums = vec![(Rgb::ZERO, 0.0); known.len()];
            for (_, rim) in self.vertices.rims.iter() {
                for &v in rim.iter().filter(|&&v| !known[v as usize]) {
                    for &w in rim.iter().filter(|&&w| known[w as usize]) {
                        let (from, step) = (self.reflected[w as usize], position(v) - position(w));
                        let rise = if ring == 0 { slopes[w as usize] * step } else { Rgb::ZERO };
                        let value = (from + rise).clamp(from * 0.5, from * 2.0);
                        sums[v as usize].0 += value / step.length();
                        sums[v as usize].1 += 1.0 / step.length();
                    }
                }
            }
            for (v, (sum, weight)) in sums.into_iter().enumerate() {
                if weight > 0.0 {
                    self.reflected[v] = sum / weight;
                    known[v] = true;
                }
            }
        }
    }

    /// Gradient of the reflected radiosity at each vertex, W/m² per scene unit: a matrix that takes
    /// a step to a change. From the elements around it that are in the light, weighted by area.
    fn slopes(&self) -> Vec<DMat3> {
        let mut sums = vec![(DMat3::ZERO, 0.0); self.reflected.len()];
        for (e, corners) in self.vertices.corners.iter().enumerate() {
            if corners.iter().any(|&v| self.covered[v as usize]) {
                continue;
            }
            let [a, b, c] = corners.map(|v| self.vertices.positions[v as usize]);
            let [p, q, r] = corners.map(|v| self.reflected[v as usize]);
            let (u, v) = (b - a, c - a);
            let n = u.cross(v);
            // The dual basis of the two edges: 1 along its own, 0 along the other.
            let (du, dv) = (v.cross(n) / n.length_squared(), n.cross(u) / n.length_squared());
            let outer = |x: Rgb, y: DVec3| DMat3::from_cols(x * y.x, x * y.y, x * y.z);
            let slope = outer(q - p, du) + outer(r - p, dv);
            let area = self.mesh.area(self.mesh.element(e));
            for &v in corners {
                sums[v as usize].0 += slope * area;
                sums[v as usize].1 += area;
            }
        }
        sums.into_iter().map(|(s, area)| if area > 0.0 { s * (1.0 / area) } else { s }).collect()
    }

    /// The mesh with what its vertices emit and reflect.
    fn surface(&self) -> VertexRadiosity {
        let count = self.vertices.positions.len();
        let mut out = VertexRadiosity {
            positions: self.vertices.positions.clone(),
            normals: vec![DVec3::ZERO; count],
            radiosity: vec![Rgb::ZERO; count],
            ..Default::default()
        };
        for (e, rim) in self.vertices.rims.iter() {
            let node = self.mesh.element(e);
            let emitted = self.mesh.material(node).exitance;
            for v in rim.iter().map(|&v| v as usize) {
                out.normals[v] += self.mesh.normal(node) * self.mesh.area(node);
                out.radiosity[v] = emitted + self.reflected[v];
            }
        }
        out.normals.iter_mut().for_each(|n| *n = n.normalize_or_zero());
        let seams = Seams::new(&self.mesh, &self.smooth, &self.vertices);
        out.add_elements(&self.mesh, &seams, |out, e| {
            let corners = self.vertices.corners[e].map(|v| out.radiosity[v as usize]);
            corners.iter().sum::<Rgb>() / 3.0
        });
        out
    }
}

/// How far from the light covered vertices are filled: as far as elements that reach it have.
const RINGS: usize = 3;

/// A side of an element's parent.
struct Side {
    /// Mean of its ends, W/m².
    mean: Rgb,
    /// At its middle, W/m².
    middle: Rgb,
    /// Whether the middle is in the light.
    lit: bool,
    /// Whether all three are.
    known: bool,
}

impl Side {
    fn bend(&self) -> Rgb {
        self.middle - self.mean
    }
}
