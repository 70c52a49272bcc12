//! Points in and out: given ones, path traced and compared; measured ones, in colours.

use std::fmt::Write;
use std::path::Path;

use glam::DVec3;
use radiosity::verify::{PathTracer, Reflected, SurfacePoint, Verification};
use radiosity::{Error, ErrorKind, Rgb, Scene};
use serde_json::Value;

use crate::{args, progress};

/// Points of a file.
pub struct Points(Vec<Point>);

/// A point of a file.
struct Point {
    position: DVec3,
    normal: DVec3,
    /// Radiosity and its standard error as others found them, W/m² per channel.
    known: Option<(Rgb, Rgb)>,
}

/// Points of a file, path traced.
pub struct TracedPoints {
    points: Points,
    /// Radiosity, emitted and reflected, and its standard error, W/m² per channel.
    found: Vec<(Rgb, Rgb)>,
    paths: usize,
}

impl Points {
    /// Reads a list "points" of places "p" and normals "n", and perhaps "B" and "se".
    pub fn read(path: &Path) -> Result<Points, Error> {
        let wrong = |kind, place: String, found: String| {
            let remedy = "give {\"points\": [{\"p\": [x, y, z], \"n\": [x, y, z]}, …]}";
            Error::new(kind, format!("{}{place}", path.display()), found, remedy)
        };
        let text = std::fs::read(path)
            .map_err(|e| wrong(ErrorKind::File, String::new(), e.to_string()).with_source(e))?;
        let malformed = |place, found| wrong(ErrorKind::Scene, place, found);
        let json: Value = serde_json::from_slice(&text)
            .map_err(|e| malformed(String::new(), e.to_string()).with_source(e))?;
        let list = json["points"].as_array();
        let list = list.ok_or_else(|| malformed(String::new(), "no list \"points\"".into()))?;
        let point = |(k, point): (usize, &Value)| {
            let needed = |key: &str| {
                let place = format!(": point {}", k + 1);
                let not = || malformed(place, format!("\"{key}\" is not three finite numbers"));
                vector(&point[key]).ok_or_else(not)
            };
            let (position, normal) = (needed("p")?, needed("n")?.normalize_or_zero());
            let known = vector(&point["B"]).zip(vector(&point["se"]));
            Ok(Point { position, normal, known })
        };
        list.iter().enumerate().map(point).collect::<Result<_, _>>().map(Points)
    }

    /// Traces `paths` paths at every point; `file` is where they are from, for errors.
    pub fn trace(
        self,
        scene: &Scene,
        paths: usize,
        seed: u64,
        file: &Path,
    ) -> Result<TracedPoints, Error> {
        let tracer = PathTracer::new(scene);
        let locate = |(k, point): (usize, &Point)| {
            tracer.locate(point.position, point.normal).ok_or_else(|| {
                let place = format!("{}: point {}", file.display(), k + 1);
                let found = format!("no surface at {} facing {}", point.position, point.normal);
                let remedy = "give points on fronts of the scene, with unit normals";
                Error::new(ErrorKind::Scene, place, found, remedy)
            })
        };
        let located: Vec<SurfacePoint> =
            self.0.iter().enumerate().map(locate).collect::<Result<_, _>>()?;
        let reflected =
            progress::of_count("points", |report| tracer.reflected(&located, paths, seed, report));
        let whole = |(point, reflected): (&SurfacePoint, Reflected)| {
            let exitance = scene.material(point.triangle).exitance;
            (exitance + reflected.radiosity, reflected.standard_error)
        };
        let found = located.iter().zip(reflected).map(whole).collect();
        Ok(TracedPoints { points: self, found, paths })
    }
}

impl TracedPoints {
    /// What was found against what is known, in units of the standard error of both.
    pub fn summary(&self) -> String {
        let mut out = format!("{} points, {} paths each", self.found.len(), self.paths);
        let mut differences = vec![];
        for (k, (point, (found, error))) in self.points.0.iter().zip(&self.found).enumerate() {
            let Some((known, known_error)) = point.known else { continue };
            let off = *found - known;
            let deviation = (error * error + known_error * known_error).map(f64::sqrt);
            // What reflects nothing is known.
            let each = (0..3).filter(|&c| error[c] > 0.0).map(|c| (off[c] / deviation[c], k));
            differences.extend(each);
        }
        let Some(&(worst, at)) = differences.iter().max_by(|a, b| a.0.abs().total_cmp(&b.0.abs()))
        else {
            return out;
        };
        let count = differences.len() as f64;
        let mean = differences.iter().map(|d| d.0).sum::<f64>() / count;
        let squares: f64 = differences.iter().map(|d| (d.0 - mean).powi(2)).sum();
        let _ = write!(
            out,
            "\ndifferences from B in standard errors of both, {count} channels: mean {mean:+.3}, \
             deviation {:.3}, worst {worst:+.2} at point {}",
            (squares / (count - 1.0).max(1.0)).sqrt(),
            at + 1
        );
        out
    }

    /// Position, radiosity and standard error, a line a point.
    pub fn csv(&self) -> Vec<u8> {
        let head = "x,y,z,radiosity_r,radiosity_g,radiosity_b,error_r,error_g,error_b";
        let lines = self.points.0.iter().zip(&self.found).map(|(point, (radiosity, error))| {
            let numbers = [point.position, *radiosity, *error].map(|v| v.to_array()).concat();
            numbers.iter().map(f64::to_string).collect()
        });
        args::csv(head, lines)
    }
}

fn vector(value: &Value) -> Option<DVec3> {
    let [x, y, z] = [0, 1, 2].map(|c| value[c].as_f64().filter(|x| x.is_finite()));
    Some(DVec3::new(x?, y?, z?))
}

/// The points of a verification as an ASCII PLY file, coloured by their errors.
pub fn coloured_ply(found: &Verification) -> String {
    let mut out = format!(
        "ply\nformat ascii 1.0\n\
         comment error: a share; reflected radiosity of the solution and measured: W/m2\n\
         element vertex {}\n",
        found.points.len()
    );
    let names = "x y z nx ny nz error solution_r solution_g solution_b measured_r measured_g \
                 measured_b standard_error";
    names.split(' ').for_each(|name| out += &format!("property float {name}\n"));
    for name in ["red", "green", "blue", "hidden"] {
        out += &format!("property uchar {name}\n");
    }
    out += "end_header\n";
    let usual = found.error.map_or(0.0, |error| error.value);
    for point in &found.points {
        let places = [point.position, point.normal].map(|v| v.to_array()).concat();
        let light = [point.solution, point.measured].map(|v| v.to_array()).concat();
        let words = [places, vec![point.error], light, vec![point.standard_error]].concat();
        let words: Vec<String> = words.iter().map(|x| (*x as f32).to_string()).collect();
        let [r, g, b] = if point.hidden { [128; 3] } else { colour(point.error, usual) };
        let _ = writeln!(out, "{} {r} {g} {b} {}", words.join(" "), u8::from(point.hidden));
    }
    out
}

/// From blue for no error over green for the `usual` one to red for four times that or more, even
/// in the root of the error.
fn colour(error: f64, usual: f64) -> [u8; 3] {
    let at = if usual > 0.0 { (error / usual).sqrt().clamp(0.0, 2.0) } else { 0.0 };
    let share = |x: f64| (255.0 * x.clamp(0.0, 1.0)).round() as u8;
    [share(at - 1.0), share(1.0 - (at - 1.0).abs()), share(1.0 - at)]
}
