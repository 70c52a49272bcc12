//! Error of a map as displayed.
//!
//! A bake estimates the error of its vertices. The error of a map differs, since light is not
//! linear between its texels. So points of the surfaces gather as texels do, twice, the second time
//! slightly beside, and are compared with the map's value:
//!
//! ```text
//!   e² = (shown − first) · (shown − second) / max(|mean of both|, floor)²
//! ```
//!
//! The noise of the two is independent, so that it adds nothing to the mean of e². Errors of the
//! light that both gather are not in it: [`LightMap::correct`].

use std::ops::ControlFlow;

use glam::{DVec2, DVec3};

use super::coverage::NO_TRIANGLE;
use super::footprint::Footprint;
use super::gathered::{LightMap, check_scene, gatherer};
use super::texel_points::TexelPoints;
use crate::accuracy::mean_square::{MeasuredPoint, SPLITS, Split, SquareError, TrimmedSquare};
use crate::accuracy::{Estimate, Measure};
use crate::backend::Backend;
use crate::bake::BakeResult;
use crate::error::Error;
use crate::gather::GatherPoint;
use crate::gather::gather_points::{SurfaceOffset, outlook};
use crate::gather::two_sided::{TwoSidedPoint, gather_two_sided};
use crate::geometry::barycentric::barycentric;
use crate::sampling::low_discrepancy::{golden_ratio_order, r2_point};
use crate::sampling::rotation::CellRotation;
use crate::sampling::surface::AreaSampler;
use crate::scene::Rgb;
use crate::work::{Batches, agree};

/// A point, and the map's value there.
struct ShownPoint {
    points: [TwoSidedPoint; 2],
    albedo: Rgb,
    /// Reflected radiosity, W/m².
    shown: Rgb,
    /// Area that the point represents, up to a common factor.
    area: f64,
}

impl LightMap {
    /// How far off what the map shows is from what surfaces gather, between texels too, and its
    /// standard error: the root mean square over the reflecting surfaces of relative errors, as in
    /// [`accuracy`](crate::accuracy). `baked` is the bake that the map was gathered from, before it
    /// is [corrected](LightMap::correct); what its light is off by itself is not in it.
    ///
    /// `progress` is called with the number of points done and of all points, several times a
    /// second; if it stops the work, the result is `None`, as it is if nothing reflects.
    ///
    /// # Errors
    /// Those of [`LightMap::of_bake`].
    pub fn shown_error(
        &self,
        baked: &BakeResult,
        backend: &Backend,
        mut progress: impl FnMut(usize, usize) -> ControlFlow<()>,
    ) -> Result<Option<Estimate>, Error> {
        check_scene(&self.atlas, &baked.light)?;
        let points = self.shown_points();
        let mut gatherer = gatherer(baked, backend)?;
        let field = baked.light.radiosity_field();
        let scene = self.atlas.scene();
        let (region, sky) = (baked.settings.solve.lit_region(scene), scene.sky());
        let mut errors = vec![];
        let order = golden_ratio_order(points.len());
        let (mut remaining, mut batches) = (&order[..], Batches::new(64));
        while !remaining.is_empty() {
            let (batch, pairs) = batches.try_next(&mut remaining, |batch| {
                let mut gather = |which: usize| {
                    let points: Vec<TwoSidedPoint> =
                        batch.iter().map(|&k| points[k].points[which]).collect();
                    gather_two_sided(&mut *gatherer, &field, &points)
                };
                let (first, second) = (gather(0)?, gather(1)?);
                Ok::<_, Error>(first.into_iter().zip(second).collect())
            })?;
            for (&k, (first, second)) in batch.iter().zip(&pairs) {
                let ShownPoint { albedo, shown, area, .. } = points[k];
                let pair = [first, second];
                let GatherPoint { position, normal, .. } = points[k].points[0].point;
                if !outlook(pair, normal, sky).is_hidden(&region, position) {
                    let gathered = pair.map(|sample| albedo * sample.irradiance);
                    errors.push(TexelError { shown, gathered, area });
                }
            }
            if agree(progress(points.len() - remaining.len(), points.len())).is_break() {
                return Ok(None);
            }
        }
        let measure = baked.settings.measure;
        Ok(root_mean_square(&errors, measure))
    }

    /// Half of the points lie evenly over the reflecting surfaces, half in the cells between four
    /// texels, in proportion to the cells' contrast. Each represents the area over the density of
    /// both halves (Veach and Guibas 1995, the balance heuristic).
    fn shown_points(&self) -> Vec<ShownPoint> {
        let points = PointSampler::new(self);
        let gathered = self.gathered.iter().filter(|&&gathered| gathered).count();
        // With two gathers per point, a sixteenth of the work of the texels.
        let count = (gathered / 32).clamp(2048, 16384) / 2;
        let even = points.surface.spread(count, 0.5);
        let even = even.filter_map(|at| points.point(at.triangle, at.barycentric));
        let in_cells = if points.cells.total_area() > 0.0 { count } else { 0 };
        even.chain((0..in_cells).filter_map(|k| points.in_cell(k, count))).collect()
    }

    /// The upper left texel of the cell around a point `position` in units of texels.
    fn cell(&self, position: DVec2) -> usize {
        Footprint::of(position, self.atlas.size).texels[0] as usize
    }

    /// The triangles on which the texels around a point `position` gather, or none; some repeated.
    fn triangles_of_cell(&self, position: DVec2) -> [u32; 4] {
        Footprint::of(position, self.atlas.size).texels.map(|texel| self.triangles[texel as usize])
    }

    /// Contrast of each cell: the difference of its four texels as a fraction of the darkest, by
    /// the upper left texel; 0 if one of them belongs to no surface.
    fn contrasts(&self) -> Vec<f64> {
        let radiosity: Vec<f64> = self.irradiance.iter().map(|e| e.length()).collect();
        let gathered = radiosity.iter().zip(&self.gathered).filter(|(_, gathered)| **gathered);
        let (sum, count) = gathered.fold((0.0, 0), |(sum, count), (e, _)| (sum + e, count + 1));
        let floor = (Measure::default().floor * sum / f64::from(count)).max(f64::MIN_POSITIVE);
        let [width, height] = self.atlas.size;
        let contrast = |cell: u32| {
            let [x, y] = [cell % width, cell / width];
            if x + 1 == width || y + 1 == height {
                return 0.0;
            }
            let texels = [cell, cell + 1, cell + width, cell + width + 1].map(|k| k as usize);
            if texels.iter().any(|&k| self.triangles[k] == NO_TRIANGLE) {
                return 0.0;
            }
            let values = texels.map(|k| radiosity[k]);
            let (low, high) = (
                values.into_iter().fold(f64::INFINITY, f64::min),
                values.into_iter().fold(0.0, f64::max),
            );
            (high - low) / low.max(floor)
        };
        (0..width * height).map(contrast).collect()
    }
}

/// The densities of points at which a map is measured.
struct PointSampler<'a> {
    map: &'a LightMap,
    /// The reflecting surfaces, by area.
    surface: AreaSampler,
    /// [`LightMap::contrasts`], and the cells between texels in proportion to them.
    contrasts: Vec<f64>,
    cells: AreaSampler,
    texels: TexelPoints<'a>,
    offset: SurfaceOffset,
    rotations: CellRotation,
}

impl PointSampler<'_> {
    fn new(map: &LightMap) -> PointSampler<'_> {
        let scene = map.atlas.scene();
        let areas = (0..scene.triangles().len()).map(|t| match scene.material(t).scatters() {
            true => scene.area(t),
            false => 0.0,
        });
        let contrasts = map.contrasts();
        PointSampler {
            map,
            surface: AreaSampler::new(areas),
            cells: AreaSampler::new(contrasts.iter().copied()),
            contrasts,
            texels: TexelPoints::new(&map.atlas),
            offset: SurfaceOffset::new(scene),
            rotations: CellRotation::new(&scene.bounds()),
        }
    }

    /// The point of triangle `t` with these weights of the second and third corner; none where
    /// nothing reflects.
    fn point(&self, t: usize, barycentric: [f64; 2]) -> Option<ShownPoint> {
        let (map, scene, [u, v]) = (self.map, self.map.atlas.scene(), barycentric);
        if !scene.material(t).scatters() {
            return None;
        }
        scene.first_solid(t, std::iter::once(barycentric))?;
        let position = map.atlas.texel_position(t, barycentric);
        let texel = self.texels.texel_size(t);
        let share = match map.triangles_of_cell(position).contains(&(t as u32)) {
            true => {
                let all = self.cells.total_area().max(f64::MIN_POSITIVE);
                self.contrasts[map.cell(position)] / all
            }
            false => 0.0,
        };
        let density = 1.0 / self.surface.total_area() + share / (texel * texel);
        let [a, b, c] = scene.corners(t);
        let position = a * (1.0 - u - v) + b * u + c * v;
        // Next to a side, another surface may be nearer than the near distance for this size.
        let inset = 3.0 * u.min(v).min(1.0 - u - v) * scene.area(t).sqrt();
        let size = texel.min(inset);
        let point = self.offset.gather_point(position, scene.normal(t), size);
        let point = TwoSidedPoint::new(point, scene.material(t));
        let inward = [a, b, c].iter().sum::<DVec3>() / 3.0 - position;
        let turn = self.rotations.at(point.point.position, point.point.near);
        let beside = point.beside(inward, size, turn);
        let albedo = scene.material(t).albedo();
        let shown = albedo * map.irradiance_at(t, barycentric);
        Some(ShownPoint { points: [point, beside], albedo, shown, area: 1.0 / density })
    }

    /// Point `k` of `count` in the cells between texels, if a surface is there.
    fn in_cell(&self, k: usize, count: usize) -> Option<ShownPoint> {
        let atlas = &self.map.atlas;
        let (cell, _) = self.cells.locate((k as f64 + 0.5) / count as f64);
        let corner = [cell as u32 % atlas.width(), cell as u32 / atlas.width()];
        let position = DVec2::from(corner.map(f64::from)) + DVec2::from(r2_point(k, 0.5));
        let on_triangle = |&t: &u32| {
            let [a, b, c] = atlas.corners(t as usize).map(|p| p.extend(0.0));
            let [u, v] = barycentric([a, b, c], DVec3::Z, position.extend(0.0));
            let is_inside = u.min(v).min(1.0 - u - v) >= 0.0;
            is_inside.then_some((t as usize, [u, v]))
        };
        let triangles = self.map.triangles_of_cell(position);
        let (t, barycentric) = triangles.iter().find_map(on_triangle)?;
        self.point(t, barycentric)
    }
}

/// The values at a point.
struct TexelError {
    /// Reflected radiosity, W/m²: of the map, and gathered twice.
    shown: Rgb,
    gathered: [Rgb; 2],
    /// Area that it represents, up to a common factor.
    area: f64,
}

impl TexelError {
    fn mean(&self) -> Rgb {
        (self.gathered[0] + self.gathered[1]) / 2.0
    }

    /// The square of the relative error, without bias by the noise of the gathers.
    fn square_error(&self, floor: f64) -> SquareError {
        let scale = self.mean().length().max(floor);
        let [a, b] = self.gathered.map(|gathered| (self.shown - gathered) / scale);
        let (value, rank) = (a.dot(b), ((a + b) / 2.0).length_squared());
        SquareError { splits: [Split { value, rank }; SPLITS], value, noise: 0.0, bias: 0.0 }
    }
}

/// The error by those at points, `errors`.
fn root_mean_square(errors: &[TexelError], measure: Measure) -> Option<Estimate> {
    let sum = |of: &dyn Fn(&TexelError) -> f64| errors.iter().map(of).sum::<f64>();
    let brightness = sum(&|point| point.area * point.mean().length()) / sum(&|point| point.area);
    // Where nothing arrives, nothing is wrong.
    let floor = (measure.floor * brightness).max(f64::MIN_POSITIVE);
    let point = |point: &TexelError| MeasuredPoint {
        stratum: 0,
        area: point.area,
        error: point.square_error(floor),
    };
    let points: Vec<MeasuredPoint> = errors.iter().map(point).collect();
    let mut mean = TrimmedSquare::new(&points, measure.tail)?.mean;
    mean.value = mean.value.max(0.0);
    (errors.len() > 1).then(|| mean.root())
}
