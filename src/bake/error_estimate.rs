//! How far off a solution is, by its own account.

use glam::DVec3;
use std::ops::ControlFlow;

use crate::error::Error;
use crate::gather::{Gather, GatherPoint, IrradianceSample};
use crate::progress::BatchSizer;
use crate::sampling::low_discrepancy::golden_ratio_order;
use crate::sampling::rotation::CellRotation;
use crate::sampling::surface::{AreaSampler, SurfacePoint};
use crate::scene::Rgb;
use crate::solver::Ledger;
use crate::vertex::gather_points::{SurfaceOffset, is_covered};
use crate::vertex::gathering::GatheredMesh;
use crate::visibility::buried;

/// An estimate of the error of vertex radiosity: root mean square over the area, as a share of the
/// radiosity. The squares of the parts add up to that of the whole.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct ErrorEstimate {
    /// All of it.
    pub total: f64,
    /// Light that was not shot, if it fell as evenly as the ambient term.
    pub unshot: f64,
    /// HemicubeRows have so many pixels, fans so many rays.
    pub sampling: f64,
    /// Radiosity is linear over the faces.
    pub mesh: f64,
    /// What was gathered is not settled: it would change if it shone itself.
    pub truncation: f64,
    /// An exact bound: no more than this share of all radiosity times area is missing because it was
    /// not shot, in the worst channel.
    pub unshot_bound: f64,
    /// Random places that were looked at.
    pub samples: usize,
}

/// Places that the estimate looks at, at least.
pub(super) const LEAST_PLACES: usize = 192;

/// What there is to be judged.
pub(crate) struct ErrorEstimator<'a> {
    /// What the vertices gathered, or the elements' own light.
    pub light: &'a GatheredMesh,
    /// What shone on them.
    pub sources: &'a GatheredMesh,
    /// How far off the middle of each element may be, by what is known of it: W/m², in units that
    /// have yet to be found.
    pub rest: &'a [f64],
    pub ledger: &'a Ledger,
    /// Times that all vertices have gathered.
    pub sweeps: u32,
}

/// A place that is dim or behind something, and sees what is nearer than this share of the scene's
/// diagonal, lies in a gap that nobody looks into. It is not judged.
const GAP: f64 = 0.1;

/// Errors have heavier tails than a normal distribution of the same spread: so much wider are those
/// of vertices given, that one in twenty is off by more than twice as much.
const HEAVY: f64 = 1.8;

/// A random place, and what is there.
struct Sample {
    element: usize,
    reflectance: Rgb,
    place: GatherPoint,
    /// Radiosity that the surface says, W/m².
    said: Rgb,
    emitted: Rgb,
    size: f64,
    /// Of the place, in [0, 1).
    turn: f64,
}

/// Dim is what reflects less than this share of the mean: its errors are weighed against that.
const DIM: f64 = 0.05;

impl ErrorEstimator<'_> {
    /// Looks at `count` random places, and gives the estimate and its share at each vertex, W/m².
    /// `progress` is told how many are done; when it stops that, they are enough.
    pub fn judge(
        &self,
        count: usize,
        gather: &mut dyn Gather,
        progress: &mut dyn FnMut(usize) -> ControlFlow<()>,
    ) -> Result<(ErrorEstimate, Vec<f64>), Error> {
        let samples = self.samples(count);
        let gap = GAP * self.light.mesh.scene().bounds().diagonal();
        let own = std::ptr::eq(self.light, self.sources);
        let mut looks: Vec<Option<[IrradianceSample; 3]>> = vec![None; samples.len()];
        let order = golden_ratio_order(samples.len());
        let (mut left, mut pace) = (&order[..], BatchSizer::new(FEW));
        while !left.is_empty() {
            pace.next(&mut left, |now| {
                let places: Vec<GatherPoint> = now.iter().map(|&k| samples[k].place).collect();
                // A hair away hemicubes and fans are turned otherwise.
                let turned: Vec<GatherPoint> = now.iter().map(|&k| samples[k].aside()).collect();
                let found = gather.gather(&self.sources.sources(), &places)?;
                let again = gather.gather(&self.sources.sources(), &turned)?;
                let settled = match own {
                    true => found.clone(),
                    false => gather.gather(&self.light.sources(), &places)?,
                };
                for (i, &k) in now.iter().enumerate() {
                    looks[k] = Some([found[i], again[i], settled[i]]);
                }
                Ok::<_, Error>(())
            })?;
            if progress(samples.len() - left.len()).is_break() {
                break;
            }
        }
        let looked = samples.into_iter().zip(looks);
        let (samples, looks): (Vec<Sample>, Vec<[IrradianceSample; 3]>) =
            looked.filter_map(|(s, looks)| Some((s, looks?))).unzip();
        let reflected = samples.iter().map(|s| (s.said - s.emitted).length()).sum::<f64>();
        let dim = (DIM * reflected / samples.len().max(1) as f64).max(f64::MIN_POSITIVE);
        let (mut off, mut noise, mut settling, mut guess) = (vec![], vec![], vec![], vec![]);
        for (k, s) in samples.iter().enumerate() {
            if looks[k].iter().any(|g| is_covered(g, s.size)) || s.reflectance == Rgb::ZERO {
                continue;
            }
            let [a, b, c] = looks[k].map(|g| s.emitted + s.reflectance * g.irradiance);
            let found = looks[k][0];
            let truth = (a + b) / 2.0;
            let hidden = truth.length() < dim || found.backface > buried::HIDDEN_SAMPLE;
            if hidden && found.inverse_distance * gap > 1.0 {
                continue;
            }
            let whole = truth.length().max(s.said.length()).max(dim);
            off.push((s.said - truth) / whole);
            noise.push(((a - b) / whole).length_squared() / 2.0);
            settling.push((c - a) / whole);
            guess.push((self.rest[s.element] / whole).powi(2));
        }
        let used = off.len().max(1) as f64;
        let mean = |v: &[f64]| v.iter().sum::<f64>() / used;
        // Of places that reflect nothing all is known.
        let share = used / samples.len().max(1) as f64;
        let noise = mean(&noise);
        let squares = off.iter().map(|d| d.length_squared()).sum::<f64>() / used;
        // Rare places are the worst: a standard error of that mean is added to it.
        let spread = off.iter().map(|d| (d.length_squared() - squares).powi(2)).sum::<f64>() / used;
        let squares = squares + (spread / used).sqrt();
        // Two looks have half the noise of one; between three vertices that are as wrong, on the
        // average half of it is left.
        let all = (squares - noise / 2.0).max(0.1 * squares);
        let sampling = (noise / 2.0).min(0.7 * all);
        let mesh = all - sampling;
        let drift: Vec<DVec3> = if own { off.iter().map(|&d| -d).collect() } else { settling };
        let bias = drift.iter().sum::<DVec3>() / used;
        let reflectance = self.light.mesh.mean_reflectance().max_element();
        let tail = bias.length() / (1.0 - reflectance);
        let settling = if own {
            (tail * reflectance).powi(2)
        } else {
            let local = drift.iter().map(|d| (*d - bias).length_squared()).sum::<f64>() / used;
            // What rays that differ say of a difference is small: they are the same.
            local + tail * tail
        };
        // What was not shot is a part of what is not settled.
        let open = looks.iter().map(|[g, ..]| g.escaped).sum::<f64>() / looks.len().max(1) as f64;
        let passed = if own { 1.0 } else { reflectance * (1.0 - open) };
        let (unshot, unshot_bound) = self.unshot(dim);
        let unshot = (unshot * passed.powi(self.sweeps as i32)).powi(2) / share.max(1e-30);
        let settling = (settling - unshot).max(0.0);
        let calibration = (mesh / mean(&guess).max(1e-30)).sqrt();
        let certificate = ErrorEstimate {
            total: ((all + settling + unshot) * share).sqrt(),
            unshot: (unshot * share).sqrt(),
            sampling: (sampling * share).sqrt(),
            mesh: (mesh * share).sqrt(),
            truncation: (settling * share).sqrt(),
            unshot_bound,
            samples: samples.len(),
        };
        let even = sampling + settling + unshot;
        Ok((certificate, self.at_vertices(calibration, even.sqrt())))
    }

    /// The root mean square of what `gather` is off by because it looks so many times and not more,
    /// where it is to be interpolated; by `count` places.
    pub fn sampling(&self, count: usize, gather: &mut dyn Gather) -> Result<f64, Error> {
        let samples = self.samples(count);
        let places = |aside: bool| -> Vec<GatherPoint> {
            samples.iter().map(|s| if aside { s.aside() } else { s.place }).collect()
        };
        let sources = self.sources.sources();
        let one = gather.gather(&sources, &places(false))?;
        let two = gather.gather(&sources, &places(true))?;
        let reflected = samples.iter().map(|s| (s.said - s.emitted).length()).sum::<f64>();
        let dim = (DIM * reflected / samples.len().max(1) as f64).max(f64::MIN_POSITIVE);
        let off = samples.iter().zip(one.iter().zip(&two)).map(|(s, (a, b))| {
            let [a, b] = [a, b].map(|g| s.emitted + s.reflectance * g.irradiance);
            ((a - b) / a.length().max(s.said.length()).max(dim)).length_squared() / 2.0
        });
        Ok((off.sum::<f64>() / samples.len().max(1) as f64 / 2.0).sqrt())
    }

    /// Places spread evenly over the area of the faces.
    fn samples(&self, count: usize) -> Vec<Sample> {
        let (surface, mesh) = (&self.light.surface, &self.light.mesh);
        let corners = |f: &[u32; 3]| f.map(|v| surface.positions[v as usize]);
        let area = |f: &[u32; 3]| {
            let [a, b, c] = corners(f);
            (b - a).cross(c - a).length() / 2.0
        };
        let above = SurfaceOffset::new(mesh.scene());
        let rotations = CellRotation::new(&mesh.scene().bounds());
        let sample = |point: SurfacePoint| {
            let face = &surface.faces[point.triangle];
            let [u, v] = point.barycentric;
            let mix = |[a, b, c]: [DVec3; 3]| a * (1.0 - u - v) + b * u + c * v;
            let element = surface.elements[point.triangle] as usize;
            let node = mesh.element(element);
            let (material, size) = (mesh.material(node), mesh.area(node).sqrt());
            let place = above.place(mix(corners(face)), mesh.normal(node), size);
            Sample {
                element,
                reflectance: material.reflectance,
                place,
                said: mix(face.map(|v| surface.radiosity[v as usize])),
                emitted: material.exitance,
                size,
                turn: rotations.at(place.position, place.near),
            }
        };
        AreaSampler::new(surface.faces.iter().map(area)).spread(count, 0.5).map(sample).collect()
    }

    /// Root mean square of the ambient term over the radiosity, or `dim` where that is more, and the
    /// bound.
    fn unshot(&self, dim: f64) -> (f64, f64) {
        let mesh = &self.sources.mesh;
        let mut ambient = vec![Rgb::ZERO; mesh.element_count()];
        self.ledger.add_ambient(mesh, &mut ambient);
        let (mut squares, mut area, mut flux) = (0.0, 0.0, Rgb::ZERO);
        let mut most = Rgb::ZERO;
        for (e, ambient) in ambient.iter().enumerate() {
            let node = mesh.element(e);
            let material = mesh.material(node);
            let reflected =
                self.sources.corners[e].iter().map(|&v| self.sources.reflected[v as usize]);
            let radiosity = material.exitance + reflected.sum::<Rgb>() / 3.0;
            let size = mesh.area(node);
            let whole = (radiosity + *ambient).length().max(dim);
            squares += (ambient.length() / whole).powi(2) * size;
            area += size;
            flux += radiosity * size;
            most = most.max(material.reflectance);
        }
        // Every bounce returns the largest reflectance of what is left, at most.
        let bound = self.ledger.unshot * most / (Rgb::ONE - most) / flux;
        let bound = if flux == Rgb::ZERO { 0.0 } else { bound.max_element() };
        ((squares / area).sqrt(), bound)
    }

    /// The error that each vertex of the surface may have, W/m²: what is known of the elements around
    /// it, times `calibration`; and `even`, a share of its radiosity, that is everywhere.
    fn at_vertices(&self, calibration: f64, even: f64) -> Vec<f64> {
        let surface = &self.light.surface;
        let mut sums = vec![(0.0, 0.0); surface.positions.len()];
        for (face, &e) in surface.faces.iter().zip(&surface.elements) {
            let area = self.light.mesh.area(self.light.mesh.element(e as usize));
            for &v in face {
                sums[v as usize].0 += area * self.rest[e as usize].powi(2);
                sums[v as usize].1 += area;
            }
        }
        let all = sums.into_iter().zip(&surface.radiosity);
        all.map(|((sum, area), b)| {
            let mesh = if area > 0.0 { sum / area } else { 0.0 };
            HEAVY * (mesh * calibration * calibration + (even * b.length()).powi(2)).sqrt()
        })
        .collect()
    }
}

/// Places that are looked at first, of those that are spread evenly: few, and no more when nobody
/// waits for it.
const FEW: usize = 16;

impl Sample {
    fn aside(&self) -> GatherPoint {
        let p = self.place;
        let (x, _) = p.normal.any_orthonormal_pair();
        let step = 1e-3 * self.size * (0.5 + self.turn);
        GatherPoint { position: p.position + x * step, ..p }
    }
}
