//! What is true, by path tracing at the points that a picture shows, and how far off others are.

use std::f64::consts::PI;
use std::ops::ControlFlow;

use radiosity::verify::{PathTracer, SurfacePoint};
use radiosity::{Camera, Mesh, Rgb, VertexMesh};

use crate::Result;
use crate::item_buffer::item_buffer;

/// Errors at points that reflect less than this share of the mean are a share of that, so that dark
/// corners do not outweigh all else: the measure of the module `verify`.
const FLOOR: f64 = 0.05;

/// Reflected radiosity at the points that the pixels of a square picture see, path traced: the
/// solver, the form factors and the elements have no part in it.
pub struct Truth {
    camera: Camera,
    side: u32,
    /// Per pixel the index of its point, if it sees one.
    point_of: Vec<Option<usize>>,
    /// Of each point, what it emits, W/m².
    exitance: Vec<Rgb>,
    /// Of each point, two independent estimates of what it reflects, W/m².
    reflected: [Vec<Rgb>; 2],
    /// Of each point, what errors are a share of, W/m².
    scale: Vec<f64>,
}

/// How far off a surface is, as a share of the truth.
pub struct Difference {
    /// Per pixel, above 0 where it is too bright; none where there is no surface.
    pub signed: Vec<Option<f64>>,
    /// Root mean square, and its standard error.
    pub rms: f64,
    pub standard_error: f64,
    /// The root mean square without the point that is furthest off.
    pub without_worst: f64,
}

impl Truth {
    /// From so many `paths` at each point, for the picture of `camera` with `side` pixels along an
    /// edge, each seen through its middle.
    pub fn new(mesh: &Mesh, camera: Camera, side: u32, paths: usize) -> Result<Truth> {
        // Where the points are: the picture of a mesh that shines by its coordinates.
        let mut places = VertexMesh::per_element(mesh, &vec![Rgb::ZERO; mesh.element_count()]);
        places.radiosity = places.positions.clone();
        let places = camera.image(&places, side, side, 1)?;
        let (mut points, mut exitance) = (vec![], vec![]);
        let mut add = |element: usize, place: Rgb| {
            let triangle = mesh.triangle(mesh.element(element));
            points.push(SurfacePoint { triangle, position: PI * place });
            exitance.push(mesh.exitance(element));
            points.len() - 1
        };
        let items = item_buffer(&camera, mesh, side)?;
        let pixels = items.iter().zip(&places.pixels);
        let point_of = pixels.map(|(item, &place)| item.map(|e| add(e, place))).collect();

        let tracer = PathTracer::new(mesh.scene());
        let go = |_, _| ControlFlow::Continue(());
        let estimate = |seed| tracer.reflected(&points, paths / 2, seed, go);
        let reflected = [1, 2].map(|seed| estimate(seed).iter().map(|r| r.radiosity).collect());
        let mut truth = Truth { camera, side, point_of, exitance, reflected, scale: vec![] };
        let lengths = (0..points.len()).map(|k| truth.reflected(k).length());
        let lengths: Vec<f64> = lengths.collect();
        let floor = FLOOR * mean(&lengths);
        truth.scale = lengths.iter().map(|length| length.max(floor)).collect();
        Ok(truth)
    }

    /// What point `k` reflects, W/m².
    fn reflected(&self, k: usize) -> Rgb {
        (self.reflected[0][k] + self.reflected[1][k]) / 2.0
    }

    /// Radiance of each pixel, W/(m² sr).
    pub fn radiance(&self) -> impl Iterator<Item = Rgb> {
        let radiosity = |k: usize| self.exitance[k] + self.reflected(k);
        self.point_of.iter().map(move |k| k.map_or(Rgb::ZERO, |k| radiosity(k) / PI))
    }

    /// Root mean square of its noise, as a share: half the difference of its two estimates.
    pub fn noise(&self) -> f64 {
        let [first, second] = &self.reflected;
        let square = |k: usize| ((first[k] - second[k]).length() / 2.0 / self.scale[k]).powi(2);
        mean(&(0..first.len()).map(square).collect::<Vec<_>>()).sqrt()
    }

    /// How far off the radiosity of `surface` is at the same points.
    ///
    /// Noise of the truth is no error: (B − T₁)·(B − T₂), of two independent estimates T₁ and T₂,
    /// has the mean |B − T|². The picture has that noise, the root mean square has not.
    pub fn difference(&self, surface: &VertexMesh) -> Result<Difference> {
        let image = self.camera.image(surface, self.side, self.side, 1)?;
        let mut squares = vec![];
        let mut compare = |k: usize, radiance: Rgb| {
            let told = PI * radiance - self.exitance[k];
            let [first, second] = [0, 1].map(|half| told - self.reflected[half][k]);
            squares.push(first.dot(second) / self.scale[k].powi(2));
            let off = (first + second) / 2.0;
            off.length().copysign(off.element_sum()) / self.scale[k]
        };
        let pixels = self.point_of.iter().zip(&image.pixels);
        let signed = pixels.map(|(k, &radiance)| k.map(|k| compare(k, radiance))).collect();
        let square = mean(&squares);
        let spread: Vec<f64> = squares.iter().map(|s| (s - square).powi(2)).collect();
        let count = squares.len() as f64;
        let rms = square.max(0.0).sqrt();
        let worst = squares.iter().copied().fold(0.0, f64::max);
        Ok(Difference {
            signed,
            rms,
            standard_error: (mean(&spread) / count).sqrt() / (2.0 * rms),
            without_worst: (square - worst / count).max(0.0).sqrt(),
        })
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}
