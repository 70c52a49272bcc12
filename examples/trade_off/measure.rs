//! How far off a surface is: against points of truth, or against a finer surface.

use glam::DVec3;
use radiosity::{
    Backend, BakeResult, BakeSettings, Error, GatherPoint, GatheredMesh, Rgb, VertexMesh,
};

use crate::truth::{self, Point};

/// What came out of one bake.
pub struct Measured {
    /// All stages of the bake; neither reading the file nor opening the device.
    pub seconds: f64,
    pub errors: Errors,
    /// What the certificate says.
    pub estimate: f64,
    pub vertices: usize,
    pub shot_elements: usize,
    pub elements: usize,
    pub hemicubes: u64,
    pub gathers: u64,
    /// The settings used in the end.
    pub settings: BakeSettings,
}

/// Root mean squares of relative errors.
#[derive(Clone, Copy)]
pub struct Errors {
    /// Over the area.
    pub area: f64,
    /// At truth points of all kinds.
    pub all: Option<f64>,
}

impl Measured {
    pub fn new(baked: &BakeResult, judge: &Judge) -> Result<Measured, String> {
        let surface = &baked.light.surface;
        Ok(Measured {
            seconds: seconds(baked),
            errors: judge.errors(surface)?,
            estimate: baked.estimate.total,
            vertices: surface.positions.len(),
            shot_elements: baked.mesh.element_count(),
            elements: baked.light.mesh.element_count(),
            hemicubes: baked.hemicubes,
            gathers: baked.light.gathers,
            settings: baked.settings.clone(),
        })
    }
}

/// All stages of a bake.
pub fn seconds(baked: &BakeResult) -> f64 {
    baked.timings.total()
}

/// What errors are against.
pub enum Judge {
    Truth(Vec<Point>),
    Finest(Places),
}

impl Judge {
    /// The points of a truth file.
    pub fn truth(text: &str) -> Result<Judge, String> {
        let points = truth::points(text)?;
        if let Some(k) = points.iter().position(|p| p.radiosity.length() <= 0.0) {
            return Err(format!("point {}: no radiosity, of which an error is a share", k + 1));
        }
        match points.iter().any(|p| p.kind == "area") {
            true => Ok(Judge::Truth(points)),
            false => Err("no points of kind \"area\"".into()),
        }
    }

    /// In a few words.
    pub fn name(&self) -> &'static str {
        match self {
            Judge::Truth(_) => "truth",
            Judge::Finest(_) => "finest run",
        }
    }

    fn errors(&self, surface: &VertexMesh) -> Result<Errors, String> {
        let points = match self {
            Judge::Truth(points) => points,
            Judge::Finest(places) => return Ok(Errors { area: places.error(surface), all: None }),
        };
        let (mut area, mut all) = (vec![], vec![]);
        for (k, point) in points.iter().enumerate() {
            let (off, _) = truth::off(surface, point)
                .ok_or_else(|| format!("truth point {} lies on no face of the scene", k + 1))?;
            all.push(off);
            if point.kind == "area" {
                area.push(off);
            }
        }
        Ok(Errors { area: rms(&area), all: Some(rms(&all)) })
    }
}

fn rms(off: &[f64]) -> f64 {
    (off.iter().map(|e| e * e).sum::<f64>() / off.len().max(1) as f64).sqrt()
}

/// Places spread evenly over a surface, with the radiosity there, in cells of a uniform grid.
pub struct Places {
    places: Vec<(DVec3, DVec3, Rgb)>,
    /// Places of each cell.
    cells: Vec<Vec<u32>>,
    low: DVec3,
    size: DVec3,
    /// How far from a face a place may be to lie on it.
    near: f64,
    /// Errors of what is dimmer are weighed against this.
    dim: f64,
}

const COUNT: usize = 4096;
const CELLS: usize = 32;
/// Share of the mean radiosity.
const DIM: f64 = 0.05;
/// What lies in gaps narrower than this share of the diagonal is left out, and what is dim in those
/// narrower than that.
const NARROW: f64 = 0.002;
const GAP: f64 = 0.1;
/// Looks that a place takes at what is near it.
const RAYS: u32 = 64;

impl Places {
    /// On all of the surface that others may see.
    pub fn on(light: &GatheredMesh, device: &Backend) -> Result<Places, Error> {
        let surface = &light.surface;
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for &p in &surface.positions {
            (low, high) = (low.min(p), high.max(p));
        }
        let diagonal = (high - low).length();
        let near = 1e-4 * diagonal;
        let (low, high) = (low - near, high + near);
        let mut places = Vec::with_capacity(COUNT);
        let whole: f64 = surface.faces.iter().map(|f| Face::new(surface, f).area()).sum();
        let mut below = 0.0;
        for face in &surface.faces {
            let face = Face::new(surface, face);
            below += face.area();
            while places.len() < COUNT {
                let k = places.len() as f64;
                if (k + 0.5) / COUNT as f64 * whole >= below {
                    break;
                }
                // The additive recurrence of the plastic number, folded into the triangle.
                let u = (0.5 + k * 0.754_877_666_246_693).fract();
                let v = (0.5 + k * 0.569_840_290_998_053_2).fract();
                let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                places.push((face.mix(face.corners, u, v), face.unit(), face.radiosity(u, v)));
            }
        }
        let lift = 1e-5 * diagonal;
        let above = |&(p, normal, _): &(DVec3, DVec3, Rgb)| GatherPoint {
            position: p + lift * normal,
            normal,
            near: lift / 4.0,
        };
        let above: Vec<GatherPoint> = places.iter().map(above).collect();
        let seen = device.gather(&light.mesh, RAYS)?.gather(&light.sources(), &above)?;
        let mean = places.iter().map(|p| p.2.length()).sum::<f64>() / places.len().max(1) as f64;
        let dim = (DIM * mean).max(f64::MIN_POSITIVE);
        let mut seen = seen.iter();
        // Nobody looks under what touches, nor into gaps, and vertices may say anything there.
        places.retain(|place| {
            let found = seen.next().expect("as many");
            let near = found.inverse_distance * diagonal;
            found.backface < 0.5
                && near * NARROW < 1.0
                && (near * GAP < 1.0 || place.2.length() >= dim)
        });
        let size = (high - low) / CELLS as f64;
        let cells = vec![vec![]; CELLS * CELLS * CELLS];
        let mut out = Places { places, cells, low, size, near, dim };
        for k in 0..out.places.len() {
            let [x, y, z] = out.cell(out.places[k].0);
            out.cells[(z * CELLS + y) * CELLS + x].push(k as u32);
        }
        Ok(out)
    }

    fn cell(&self, p: DVec3) -> [usize; 3] {
        ((p - self.low) / self.size).to_array().map(|c| (c.max(0.0) as usize).min(CELLS - 1))
    }

    /// Root mean square of what `surface` is off by, each place in the nearest face that faces alike.
    fn error(&self, surface: &VertexMesh) -> f64 {
        let mut best: Vec<(f64, Rgb)> = vec![(f64::INFINITY, Rgb::ZERO); self.places.len()];
        for face in &surface.faces {
            let face = Face::new(surface, face);
            let [a, b, c] = face.corners;
            let low = self.cell(a.min(b).min(c) - self.near);
            let high = self.cell(a.max(b).max(c) + self.near);
            for z in low[2]..=high[2] {
                for y in low[1]..=high[1] {
                    for x in low[0]..=high[0] {
                        for &k in &self.cells[(z * CELLS + y) * CELLS + x] {
                            let (p, n, _) = self.places[k as usize];
                            let best = &mut best[k as usize];
                            let Some((off, u, v)) = face.find(p, n) else { continue };
                            if off < best.0 {
                                *best = (off, face.radiosity(u, v));
                            }
                        }
                    }
                }
            }
        }
        let found = best.iter().zip(&self.places).filter(|(b, _)| b.0.is_finite());
        let off: Vec<f64> = found
            .map(|(b, place)| b.1.distance(place.2) / place.2.length().max(self.dim))
            .collect();
        rms(&off)
    }
}

struct Face {
    corners: [DVec3; 3],
    radiosity: [Rgb; 3],
    /// As long as twice the area.
    normal: DVec3,
}

impl Face {
    fn new(surface: &VertexMesh, face: &[u32; 3]) -> Face {
        let corners = face.map(|v| surface.positions[v as usize]);
        let radiosity = face.map(|v| surface.radiosity[v as usize]);
        let [a, b, c] = corners;
        Face { corners, radiosity, normal: (b - a).cross(c - a) }
    }

    fn area(&self) -> f64 {
        self.normal.length() / 2.0
    }

    fn unit(&self) -> DVec3 {
        self.normal.normalize_or_zero()
    }

    fn mix(&self, [a, b, c]: [DVec3; 3], u: f64, v: f64) -> DVec3 {
        a * (1.0 - u - v) + b * u + c * v
    }

    fn radiosity(&self, u: f64, v: f64) -> Rgb {
        self.mix(self.radiosity, u, v)
    }

    /// How far off the face a place is, and where on it; none if that faces otherwise.
    fn find(&self, p: DVec3, n: DVec3) -> Option<(f64, f64, f64)> {
        let (unit, twice) = (self.unit(), self.normal.length());
        if unit.dot(n) < 0.8 {
            return None;
        }
        let [a, b, c] = self.corners;
        let d = p - a;
        let u = d.cross(c - a).dot(unit) / twice;
        let v = (b - a).cross(d).dot(unit) / twice;
        let beyond = (-u).max(-v).max(u + v - 1.0).max(0.0);
        Some((beyond * twice.sqrt() + d.dot(unit).abs(), u, v))
    }
}
