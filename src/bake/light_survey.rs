//! Survey of the direct light of a scene, before any is shot.
//!
//! 512 points on the surfaces that reflect gather by 32 rays each. Two things follow:
//!
//! - *The region of the light.* Sizes of elements are shares of its diagonal. It is the box around
//!   all surfaces that reflect, unless nearly all direct light falls within a much smaller one, as
//!   in a lit room that stands on a wide plane.
//! - *The lights that are to be gathered.* Of the light of a room's lamp, most falls on the room:
//!   the lamp shoots it. Of a black box of a kilometre that stands for the sky, next to nothing
//!   falls on the house in its middle, and no hemicube of its patches resolves the house. Where
//!   less than half of a light falls on anything that reflects, each element gathers it instead.
//!
//! Sky and luminaires light what sees them, and are always gathered.
//!
//! Both are by direct light alone: what is reflected seldom falls further.

use glam::DVec3;

use crate::backend::cpu::RayGather;
use crate::gather::RadiosityField;
use crate::gather::gather_points::SurfaceOffset;
use crate::gather::{Gather, GatherPoint, IrradianceSample};
use crate::mesh::Mesh;
use crate::sampling::surface::{AreaSampler, SurfacePoint, shifted};
use crate::scene::{Aabb, Material, Rgb, Scene, Sky};

/// Where the light of a scene falls.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct LightSurvey {
    /// The box that nearly all direct light falls in, if it is much smaller than the scene.
    pub region: Option<Aabb>,
    /// Diagonal of the region, or of the box around all surfaces that reflect; scene unit.
    pub diagonal: f64,
    /// Materials, by their index and ascending, whose light is to be gathered instead of shot.
    pub gathered_materials: Vec<u32>,
}

/// A point of a surface that reflects, and the area that it stands for.
struct SurveyPoint {
    point: GatherPoint,
    area: f64,
}

impl LightSurvey {
    /// Looks at `scene`.
    pub fn new(scene: &Scene) -> LightSurvey {
        let bounds = scene.reflecting_bounds();
        let mut survey =
            LightSurvey { region: None, diagonal: bounds.diagonal(), gathered_materials: vec![] };
        let lights = strongest_lights(scene);
        let points = survey_points(scene);
        // A scene with more triangles than a mesh may have elements is refused when it is cut.
        let is_too_large = scene.triangles().len() > Mesh::MAX_ELEMENTS;
        let has_others = scene.has_light_of_no_surface();
        if (lights.is_empty() && !has_others) || points.is_empty() || is_too_large {
            return survey;
        }
        // Direct light at each point: flux over the area that it stands for, W.
        let mut flux = vec![0.0; points.len()];
        if has_others {
            let seen = look(scene, &[], &points);
            for ((flux, point), seen) in flux.iter_mut().zip(&points).zip(&seen) {
                *flux += point.area * seen.irradiance.length();
            }
        }
        for first in (0..lights.len()).step_by(3) {
            let lights = &lights[first..lights.len().min(first + 3)];
            let seen = look(scene, lights, &points);
            for (channel, light) in lights.iter().enumerate() {
                let exitance = scene.materials()[light.material as usize].exitance.length();
                let mut landing = 0.0;
                for ((flux, point), seen) in flux.iter_mut().zip(&points).zip(&seen) {
                    let factor = seen.irradiance[channel];
                    landing += point.area * factor;
                    *flux += point.area * factor * exitance;
                }
                if landing < 0.5 * light.area {
                    survey.gathered_materials.push(light.material);
                }
            }
        }
        survey.gathered_materials.sort_unstable();
        let positions = points.iter().map(|point| point.point.position);
        let flux: Vec<(DVec3, f64)> = positions.zip(flux).collect();
        if let Some(region) = Aabb::concentrated(&flux, bounds.diagonal()) {
            survey.diagonal = region.diagonal();
            survey.region = Some(region);
        }
        survey
    }
}

/// All triangles of one material that emits.
struct MaterialLight {
    material: u32,
    /// Length unit squared.
    area: f64,
    /// W, a length over the channels.
    flux: f64,
}

/// The lights with the largest flux, largest first.
fn strongest_lights(scene: &Scene) -> Vec<MaterialLight> {
    let mut areas = vec![0.0; scene.materials().len()];
    for (t, triangle) in scene.triangles().iter().enumerate() {
        areas[triangle.material as usize] += scene.solid_area(t);
    }
    let light = |(material, area): (u32, f64)| {
        let flux = scene.materials()[material as usize].exitance.length() * area;
        MaterialLight { material, area, flux }
    };
    let mut lights: Vec<MaterialLight> =
        (0..).zip(areas).map(light).filter(|light| light.flux > 0.0).collect();
    lights.sort_by(|a, b| b.flux.total_cmp(&a.flux).then(a.material.cmp(&b.material)));
    // All others are shot: no scene has a sky of surfaces among weaker ones.
    lights.truncate(12);
    lights
}

/// Points spread over all surfaces that reflect: half by area, half by triangles, so that small
/// surfaces get some beside large ones.
fn survey_points(scene: &Scene) -> Vec<SurveyPoint> {
    let scatters = |&t: &usize| scene.material(t).scatters() && scene.solid_area(t) > 0.0;
    let triangles: Vec<usize> = (0..scene.triangles().len()).filter(scatters).collect();
    let area: f64 = triangles.iter().map(|&t| scene.solid_area(t)).sum();
    let density = |t: usize| 0.5 * scene.solid_area(t) / area + 0.5 / triangles.len() as f64;
    let sampler = AreaSampler::new(triangles.iter().map(|&t| density(t)));
    let above = SurfaceOffset::new(scene);
    let count = 512;
    let sample = |SurfacePoint { triangle, barycentric }: SurfacePoint| {
        let t = triangles[triangle];
        let [u, v] = scene.first_solid(t, shifted(barycentric)).unwrap_or(barycentric);
        let [a, b, c] = scene.corners(t);
        let position = a * (1.0 - u - v) + b * u + c * v;
        let size = scene.area(t).sqrt();
        let point = above.gather_point(position, scene.normal(t), size.min(area.sqrt() * 1e-3));
        SurveyPoint { point, area: scene.solid_area(t) / density(t) / f64::from(count) }
    };
    sampler.spread(count as usize, 0.5).map(sample).collect()
}

/// What each of `points` sees where each of up to three `lights` emits 1 W/m² in a channel of its
/// own and nothing else does: the irradiances are form factors, visible shares of the hemisphere,
/// weighted by the cosine. With no lights what it sees of all that no surface emits.
fn look(scene: &Scene, lights: &[MaterialLight], points: &[SurveyPoint]) -> Vec<IrradianceSample> {
    let mut materials: Vec<Material> = scene.materials().to_vec();
    for material in &mut materials {
        if material.clear_transmittance().is_none() {
            // It blocks light also where it does not emit.
            material.specular = None;
        }
        material.exitance = Rgb::ZERO;
    }
    for (light, channel) in lights.iter().zip([Rgb::X, Rgb::Y, Rgb::Z]) {
        materials[light.material as usize].exitance = channel;
    }
    let mut looked_at = scene.with_materials(materials).expect("as many materials, all in range");
    if !lights.is_empty() {
        looked_at = looked_at.with_sky(Sky::default()).expect("a black sky");
        looked_at = looked_at.with_luminaires(vec![]).expect("none");
    }
    let mesh = Mesh::new(looked_at, f64::INFINITY).expect("no splits");
    let points: Vec<GatherPoint> = points.iter().map(|point| point.point).collect();
    let corners = vec![[0; 3]; mesh.element_count()];
    let mut rays = RayGather::new(&mesh, 32).expect("a number of rays in range");
    rays.gather(&dark(&mesh, &corners), &points).expect("rays do not fail")
}

/// The field of `mesh` in which nothing is reflected, so that only lights are seen; `corners` has
/// three zeros for each element.
pub(super) fn dark<'a>(mesh: &'a Mesh, corners: &'a [[u32; 3]]) -> RadiosityField<'a> {
    RadiosityField { mesh, corners, reflected: &[Rgb::ZERO] }
}

#[cfg(test)]
mod tests;
