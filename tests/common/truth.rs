//! Radiosity at points against path-traced truth, per kind of point.
#![allow(dead_code)]

use std::collections::BTreeMap;

use glam::DVec3;
use radiosity::{Rgb, VertexRadiosity};
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

/// Compares `surface`, interpolated in its faces, with the points of a truth file. Panics when a
/// point lies on no face.
pub fn compare(surface: &VertexRadiosity, truth: &str) -> BTreeMap<String, Errors> {
    let truth: Value = serde_json::from_str(truth).expect("JSON");
    let mut errors: BTreeMap<String, Vec<(f64, f64)>> = BTreeMap::new();
    for point in truth["points"].as_array().expect("points") {
        let vector = |key: &str| {
            DVec3::from_array([0, 1, 2].map(|k| point[key][k].as_f64().expect("a number")))
        };
        let (wanted, got) = (vector("B"), at(surface, vector("p"), vector("n")));
        let got = got.expect("a face at the point");
        let error = got.distance(wanted) / wanted.length();
        let signed = got.length() / wanted.length() - 1.0;
        errors
            .entry(point["kind"].as_str().expect("a kind").into())
            .or_default()
            .push((error, signed));
    }
    errors.into_iter().map(|(kind, list)| (kind, summary(list))).collect()
}

fn summary(errors: Vec<(f64, f64)>) -> Errors {
    let count = errors.len();
    let bias = errors.iter().map(|e| e.1).sum::<f64>() / count as f64;
    let mut errors: Vec<f64> = errors.into_iter().map(|e| e.0).collect();
    errors.sort_by(f64::total_cmp);
    let rms = (errors.iter().map(|e| e * e).sum::<f64>() / count as f64).sqrt();
    Errors { count, bias, rms, median: errors[count / 2], worst: errors[count - 1] }
}

/// Interpolated radiosity at `p` with unit normal `n`, in the nearest face that faces alike.
fn at(surface: &VertexRadiosity, p: DVec3, n: DVec3) -> Option<Rgb> {
    let mut best: Option<(f64, Rgb)> = None;
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
            best = Some((off, x * (1.0 - u - v) + y * u + z * v));
        }
    }
    // Points are given to four decimals of a millimetre, on walls that are planar to about that.
    best.filter(|&(off, _)| off < 1.0).map(|b| b.1)
}
