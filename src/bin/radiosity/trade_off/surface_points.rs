//! Points spread evenly over what reflects of a surface, with the radiosity there, to compare other
//! surfaces with: by the measure of error that the bake's estimate has.

use glam::DVec3;
use radiosity::gather::GatherPoint;
use radiosity::{Backend, Error, GatheredMesh, Rgb, VertexMesh};

use super::face::Face;
use super::reference::{FLOOR, rms};

/// A point and what leaves it.
struct SurfacePoint {
    position: DVec3,
    normal: DVec3,
    /// W/m² per channel.
    radiosity: Rgb,
    /// The reflected part of it, W/m²: a length over the channels.
    reflected: f64,
}

/// Points in the cells of a uniform grid.
pub struct SurfacePoints {
    points: Vec<SurfacePoint>,
    /// Indices into `points`, for each cell.
    cells: Vec<Vec<u32>>,
    low: DVec3,
    /// Of a cell, scene unit.
    size: DVec3,
    /// How far off a face a point may be to lie on it, scene unit.
    reach: f64,
    /// Errors of what is dimmer are relative to this radiosity, W/m².
    dim: f64,
}

/// Points that are spread over the area.
const COUNT: usize = 4096;

/// Cells of the grid along each axis.
const CELLS: usize = 32;

/// Points that see more backs than this share of their hemisphere are inside a solid.
const HIDDEN: f64 = 0.95;

/// Points that see more backs than this share, and nearer ones than [`NEAR`], are under something.
const NEAR_BACKS: f64 = 0.4;

/// Share of the diagonal of all that reflects.
const NEAR: f64 = 0.002;

/// Points whose mean of 1/distance is above one over this share of that diagonal are in a crack.
const CRACK: f64 = 1e-4;

/// Rays of a point that find out how wide the gap is that it lies in.
const RAYS: u32 = 64;

/// How far off a face a point may be to lie on it, as a share of the diagonal.
const REACH: f64 = 1e-4;

/// How far above the surface rays start, as a share of the diagonal.
const OFFSET: f64 = 1e-5;

impl SurfacePoints {
    /// On all of the surface that reflects and can be looked at: not under what touches it.
    pub fn new(light: &GatheredMesh, device: &Backend) -> Result<SurfacePoints, Error> {
        let surface = &light.surface;
        let (low, high) = bounds(surface);
        let diagonal = (high - low).length();
        let reach = REACH * diagonal;
        let (low, high) = (low - reach, high + reach);
        let mut points = spread(light);
        let mean = points.iter().map(|p| p.reflected).sum::<f64>();
        let mean = mean / points.len().max(1) as f64;
        let dim = (FLOOR * mean).max(f64::MIN_POSITIVE);
        let lowest = points.iter().fold(DVec3::INFINITY, |low, p| low.min(p.position));
        let highest = points.iter().fold(DVec3::NEG_INFINITY, |high, p| high.max(p.position));
        let reflecting = (highest - lowest).length();
        let near = NEAR_BACKS / (NEAR * reflecting);
        let offset = OFFSET * diagonal;
        let above = |point: &SurfacePoint| GatherPoint {
            position: point.position + offset * point.normal,
            normal: point.normal,
            near: offset / 4.0,
        };
        let above: Vec<GatherPoint> = points.iter().map(above).collect();
        let samples = device.gather(&light.mesh, RAYS)?.gather(&light.radiosity_field(), &above)?;
        let mut samples = samples.iter();
        points.retain(|_| {
            let sample = samples.next().expect("a sample for every point");
            let is_covered = sample.backface > NEAR_BACKS && sample.inverse_distance > near;
            let is_in_crack = sample.inverse_distance * CRACK * reflecting > 1.0;
            !is_covered && !is_in_crack && sample.backface <= HIDDEN
        });
        let size = (high - low) / CELLS as f64;
        let cells = vec![vec![]; CELLS * CELLS * CELLS];
        let mut all = SurfacePoints { points, cells, low, size, reach, dim };
        for k in 0..all.points.len() {
            let cell = index(all.cell(all.points[k].position));
            all.cells[cell].push(k as u32);
        }
        Ok(all)
    }

    fn cell(&self, p: DVec3) -> [usize; 3] {
        ((p - self.low) / self.size).to_array().map(|c| (c.max(0.0) as usize).min(CELLS - 1))
    }

    /// Root mean square of the errors of `surface`, each point in the nearest face that faces
    /// alike.
    pub fn error(&self, surface: &VertexMesh) -> f64 {
        let mut nearest: Vec<(f64, Rgb)> = vec![(f64::INFINITY, Rgb::ZERO); self.points.len()];
        for face in &surface.faces {
            let face = Face::new(surface, face);
            for cell in self.cells_of(&face) {
                for &k in &self.cells[cell] {
                    let point = &self.points[k as usize];
                    let nearest = &mut nearest[k as usize];
                    let Some(location) = face.locate(point.position, point.normal) else {
                        continue;
                    };
                    if location.distance < nearest.0 {
                        *nearest = (location.distance, location.radiosity);
                    }
                }
            }
        }
        let located = nearest.iter().zip(&self.points).filter(|(n, _)| n.0.is_finite());
        let errors: Vec<f64> = located
            .map(|((_, radiosity), point)| {
                radiosity.distance(point.radiosity) / point.reflected.max(self.dim)
            })
            .collect();
        rms(&errors)
    }

    /// Indices of the cells that points of `face` may be in.
    fn cells_of(&self, face: &Face) -> impl Iterator<Item = usize> {
        let [a, b, c] = face.corners;
        let low = self.cell(a.min(b).min(c) - self.reach);
        let high = self.cell(a.max(b).max(c) + self.reach);
        let xs = move || low[0]..=high[0];
        let rows = (low[2]..=high[2]).flat_map(move |z| (low[1]..=high[1]).map(move |y| (y, z)));
        rows.flat_map(move |(y, z)| xs().map(move |x| index([x, y, z])))
    }
}

fn index([x, y, z]: [usize; 3]) -> usize {
    (z * CELLS + y) * CELLS + x
}

/// The box around all vertices.
pub fn bounds(surface: &VertexMesh) -> (DVec3, DVec3) {
    let start = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    surface.positions.iter().fold(start, |(low, high), &p| (low.min(p), high.max(p)))
}

/// [`COUNT`] points, as many on each face that reflects as its share of the area.
fn spread(light: &GatheredMesh) -> Vec<SurfacePoint> {
    let surface = &light.surface;
    let material = |f: usize| light.mesh.material(light.mesh.element(surface.elements[f] as usize));
    let faces: Vec<(Face, Rgb)> = (0..surface.faces.len())
        .filter(|&f| material(f).reflectance != Rgb::ZERO)
        .map(|f| (Face::new(surface, &surface.faces[f]), material(f).exitance))
        .collect();
    let mut points = Vec::with_capacity(COUNT);
    let total: f64 = faces.iter().map(|(face, _)| face.area()).sum();
    let mut area = 0.0;
    for (face, exitance) in faces {
        area += face.area();
        while points.len() < COUNT {
            let k = points.len() as f64;
            if (k + 0.5) / COUNT as f64 * total >= area {
                break;
            }
            // The additive recurrence R2 (Roberts 2018), folded into the triangle.
            let u = (0.5 + k * 0.754_877_666_246_693).fract();
            let v = (0.5 + k * 0.569_840_290_998_053_2).fract();
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            let radiosity = face.radiosity(u, v);
            points.push(SurfacePoint {
                position: face.position(u, v),
                normal: face.unit_normal(),
                radiosity,
                reflected: (radiosity - exitance).length(),
            });
        }
    }
    points
}
