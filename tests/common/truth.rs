//! Radiosity at points against path-traced truth, per kind of point.
#![allow(dead_code, reason = "each test program uses a part of it")]

use std::collections::BTreeMap;

use glam::DVec3;
use radiosity::{Rgb, VertexMesh};
use serde_json::Value;

/// Error |B − truth|/|truth| of one kind of points, lengths over the channels.
#[derive(Clone, Copy, Debug)]
pub struct Errors {
    pub count: usize,
    /// Mean of (|B| − |truth|)/|truth|.
    pub bias: f64,
    pub rms: f64,
    pub median: f64,
    pub worst: f64,
}

/// A point of a truth file.
#[derive(Clone, Debug)]
pub struct Point {
    pub kind: String,
    pub position: DVec3,
    pub normal: DVec3,
    pub radiosity: Rgb,
}

/// The points of a truth file, or what is wrong with it.
pub fn points(truth: &str) -> Result<Vec<Point>, String> {
    let truth: Value = serde_json::from_str(truth).map_err(|e| e.to_string())?;
    let points = truth["points"].as_array().ok_or("no list \"points\"")?;
    let read = |(k, point): (usize, &Value)| {
        let vector = |key: &str| {
            let [x, y, z] = [0, 1, 2].map(|c| point[key][c].as_f64());
            let vector = x.zip(y).zip(z).map(|((x, y), z)| DVec3::new(x, y, z));
            vector.ok_or_else(|| format!("point {}: \"{key}\" is not three numbers", k + 1))
        };
        let kind = point["kind"].as_str();
        Ok(Point {
            kind: kind.ok_or_else(|| format!("point {}: no \"kind\"", k + 1))?.into(),
            position: vector("p")?,
            normal: vector("n")?,
            radiosity: vector("B")?,
        })
    };
    points.iter().enumerate().map(read).collect()
}

/// Compares `surface`, interpolated in its faces, with the points of a truth file. Panics when a
/// point lies on no face.
pub fn compare(surface: &VertexMesh, truth: &str) -> BTreeMap<String, Errors> {
    let points = points(truth).expect("a truth file");
    let mut errors: BTreeMap<String, Vec<(f64, f64)>> = BTreeMap::new();
    for point in points {
        let found = off(surface, &point).expect("a face at the point");
        errors.entry(point.kind).or_default().push(found);
    }
    errors.into_iter().map(|(kind, list)| (kind, summary(list))).collect()
}

/// The root mean square of |B − truth| over |truth|, or over a twentieth of its mean where that is
/// more, at the 99 % of the points spread evenly over the area where it is smallest.
pub fn area_error(surface: &VertexMesh, truth: &str) -> f64 {
    let points = points(truth).expect("a truth file");
    let area: Vec<_> = points.iter().filter(|p| p.kind == "area").collect();
    let mean = area.iter().map(|p| p.radiosity.length()).sum::<f64>() / area.len() as f64;
    let square = |point: &&Point| {
        let (found, _) = at(surface, point.position, point.normal).expect("a face at the point");
        let scale = point.radiosity.length().max(0.05 * mean);
        (found.distance(point.radiosity) / scale).powi(2)
    };
    let mut squares: Vec<f64> = area.iter().map(square).collect();
    squares.sort_by(f64::total_cmp);
    squares.truncate((0.99 * squares.len() as f64).round() as usize);
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

/// |B − truth|/|truth| and (|B| − |truth|)/|truth| at a point, if it lies on a face of `surface`.
pub fn off(surface: &VertexMesh, point: &Point) -> Option<(f64, f64)> {
    let (got, _) = at(surface, point.position, point.normal)?;
    let whole = point.radiosity.length();
    Some((got.distance(point.radiosity) / whole, got.length() / whole - 1.0))
}

fn summary(errors: Vec<(f64, f64)>) -> Errors {
    let count = errors.len();
    let bias = errors.iter().map(|e| e.1).sum::<f64>() / count as f64;
    let mut errors: Vec<f64> = errors.into_iter().map(|e| e.0).collect();
    errors.sort_by(f64::total_cmp);
    let rms = (errors.iter().map(|e| e * e).sum::<f64>() / count as f64).sqrt();
    Errors { count, bias, rms, median: errors[count / 2], worst: errors[count - 1] }
}

/// Interpolated radiosity, and the error it may have, at `p` with unit normal `n`, in the nearest
/// face that faces alike.
pub fn at(surface: &VertexMesh, p: DVec3, n: DVec3) -> Option<(Rgb, f64)> {
    let mut best: Option<(f64, (Rgb, f64))> = None;
    for face in &surface.faces {
        let [a, b, c] = face.map(|v| surface.positions[v as usize]);
        let (e1, e2, d) = (b - a, c - a, p - a);
        let normal = e1.cross(e2);
        let unit = normal.normalize();
        if unit.dot(n) < 0.8 {
            continue;
        }
        let (u, v) = (d.cross(e2).dot(unit), e1.cross(d).dot(unit));
        let (u, v) = (u / normal.length(), v / normal.length());
        let beyond = (-u).max(-v).max(u + v - 1.0).max(0.0);
        let off = beyond * normal.length().sqrt() + d.dot(unit).abs();
        if best.is_none_or(|(least, _)| off < least) {
            let [x, y, z] = face.map(|v| surface.radiosity[v as usize]);
            let told = face.map(|v| surface.error.get(v as usize).copied().unwrap_or(0.0));
            let told = told[0] * (1.0 - u - v) + told[1] * u + told[2] * v;
            best = Some((off, (x * (1.0 - u - v) + y * u + z * v, told)));
        }
    }
    // Points are given to four decimals of a millimetre, on walls that are planar to about that.
    best.filter(|&(off, _)| off < 1.0).map(|b| b.1)
}
