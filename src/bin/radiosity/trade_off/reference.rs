//! What the light of a run is compared with: points of known radiosity, or a finer run.

use glam::DVec3;
use radiosity::{Rgb, VertexMesh};
use serde_json::Value;

use super::face::{Face, Location};
use super::measure::Errors;
use super::surface_points::SurfacePoints;

pub enum Reference {
    Truth(Vec<TruthPoint>),
    Finest(SurfacePoints),
}

/// A point of a truth file.
pub struct TruthPoint {
    /// Why the point was chosen: "area" for those spread evenly over the area.
    kind: String,
    position: DVec3,
    normal: DVec3,
    /// W/m² per channel.
    radiosity: Rgb,
}

/// Errors are relative to no less than this share of the mean radiosity.
pub const FLOOR: f64 = 0.05;

/// How far off a face a truth point may lie, as a share of the scene's diagonal: points are
/// rounded, and faces may be a little bent.
const OFF_FACE: f64 = 1e-3;

impl Reference {
    /// The points of a truth file, or what is wrong with it.
    pub fn truth(text: &str) -> Result<Reference, String> {
        let points = truth_points(text)?;
        if let Some(k) = points.iter().position(|p| p.radiosity.length() <= 0.0) {
            return Err(format!("point {}: no radiosity, of which an error is a share", k + 1));
        }
        if !points.iter().any(TruthPoint::is_over_area) {
            return Err("no points of kind \"area\"".into());
        }
        Ok(Reference::Truth(points))
    }

    /// In a few words.
    pub fn name(&self) -> &'static str {
        match self {
            Reference::Truth(_) => "truth",
            Reference::Finest(_) => "finest run",
        }
    }

    pub fn errors(&self, surface: &VertexMesh) -> Result<Errors, String> {
        let points = match self {
            Reference::Truth(points) => points,
            Reference::Finest(points) => {
                return Ok(Errors { area: points.error(surface), all: None });
            }
        };
        let (low, high) = super::surface_points::bounds(surface);
        let limit = OFF_FACE * (high - low).length();
        let spread = points.iter().filter(|point| point.is_over_area());
        let lengths: Vec<f64> = spread.map(|point| point.radiosity.length()).collect();
        let dim = FLOOR * lengths.iter().sum::<f64>() / lengths.len().max(1) as f64;
        let (mut area, mut all) = (vec![], vec![]);
        for (k, point) in points.iter().enumerate() {
            let error = point
                .error(surface, limit, dim)
                .ok_or_else(|| format!("truth point {} lies on no face of the scene", k + 1))?;
            all.push(error);
            if point.is_over_area() {
                area.push(error);
            }
        }
        Ok(Errors { area: rms(&area), all: Some(rms(&all)) })
    }
}

impl TruthPoint {
    pub fn is_over_area(&self) -> bool {
        self.kind == "area"
    }

    /// The error of `surface` at the point, as a share of its radiosity or of `dim` (W/m²) where
    /// that is more, in the nearest face within `limit` that faces alike.
    fn error(&self, surface: &VertexMesh, limit: f64, dim: f64) -> Option<f64> {
        let mut nearest: Option<Location> = None;
        for face in &surface.faces {
            let face = Face::new(surface, face);
            let Some(location) = face.locate(self.position, self.normal) else { continue };
            if nearest.as_ref().is_none_or(|nearest| location.distance < nearest.distance) {
                nearest = Some(location);
            }
        }
        let nearest = nearest.filter(|location| location.distance < limit)?;
        Some(nearest.radiosity.distance(self.radiosity) / self.radiosity.length().max(dim))
    }
}

fn truth_points(text: &str) -> Result<Vec<TruthPoint>, String> {
    let truth: Value = serde_json::from_str(text).map_err(|e| e.to_string())?;
    let points = truth["points"].as_array().ok_or("no list \"points\"")?;
    let read = |(k, point): (usize, &Value)| {
        let vector = |key: &str| {
            let [x, y, z] = [0, 1, 2].map(|c| point[key][c].as_f64());
            let vector = x.zip(y).zip(z).map(|((x, y), z)| DVec3::new(x, y, z));
            vector.ok_or_else(|| format!("point {}: \"{key}\" is not three numbers", k + 1))
        };
        let kind = point["kind"].as_str();
        Ok(TruthPoint {
            kind: kind.ok_or_else(|| format!("point {}: no \"kind\"", k + 1))?.into(),
            position: vector("p")?,
            normal: vector("n")?,
            radiosity: vector("B")?,
        })
    };
    points.iter().enumerate().map(read).collect()
}

/// Root mean square.
pub fn rms(errors: &[f64]) -> f64 {
    (errors.iter().map(|e| e * e).sum::<f64>() / errors.len().max(1) as f64).sqrt()
}
