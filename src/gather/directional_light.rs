//! Light from known directions, that of the sun and of luminaires, at points of surfaces: by rays.

use std::sync::Arc;

use super::GatherPoint;
use super::luminaire_light::LuminaireLight;
use super::two_sided::TwoSidedPoint;
use crate::sampling::low_discrepancy::sobol_02_point;
use crate::sampling::rotation::{CellRotation, second_rotation};
use crate::scene::{Rgb, Scene, Sun};
use crate::visibility::panes::Panes;
use crate::visibility::ray_scene::RayScene;

/// Rays to the disc of the sun: at first, and where some are free and some are not. A penumbra then
/// has 16 steps, each less than what an element at its edge may be off by.
const RAYS_TO_SUN: [u32; 2] = [4, 16];

/// The sun and the luminaires of a scene, and what rays to them meet.
#[derive(Debug)]
pub(super) struct DirectionalLight {
    scene: Arc<Scene>,
    rays: Arc<RayScene>,
    panes: Panes,
    rotations: CellRotation,
}

/// What that light adds to the reflected radiosity of a vertex, W/m² per channel.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Direct {
    /// If nothing were in its way.
    pub unoccluded: Rgb,
    pub arriving: Rgb,
}

impl Direct {
    /// The share that arrives, in [0, 1]; none where there is nothing to be hidden.
    pub fn share(&self) -> Option<f64> {
        let all = self.unoccluded.length();
        (all > 0.0).then(|| self.arriving.length() / all)
    }
}

impl DirectionalLight {
    /// That of `scene`, if it has a sun or luminaires.
    pub fn of_scene(scene: Arc<Scene>) -> Option<DirectionalLight> {
        scene.has_directional_light().then(|| DirectionalLight {
            rays: RayScene::of_scene(&scene),
            panes: Panes::of_scene(&scene),
            rotations: CellRotation::new(&scene.bounds()),
            scene,
        })
    }

    /// What it adds to the reflected radiosity of a surface of this `albedo` at `point`.
    pub fn reflected(&self, albedo: Rgb, point: &TwoSidedPoint) -> Direct {
        let Direct { unoccluded, arriving } = self.irradiance(point);
        Direct { unoccluded: albedo * unoccluded, arriving: albedo * arriving }
    }

    /// Irradiance on both sides of `point`, by their shares, W/m² per channel.
    fn irradiance(&self, point: &TwoSidedPoint) -> Direct {
        let mut sum = Direct::default();
        for (share, point) in point.shares().into_iter().zip([point.point, point.other_side()]) {
            if share == Rgb::ZERO {
                continue;
            }
            if let Some(sun) = self.scene.sky().sun() {
                let Direct { unoccluded, arriving } = self.of_sun(sun, &point);
                sum.unoccluded += share * unoccluded;
                sum.arriving += share * arriving;
            }
            let luminaires = LuminaireLight {
                luminaires: self.scene.luminaires(),
                rays: &self.rays,
                panes: &self.panes,
                rotations: &self.rotations,
            };
            sum.unoccluded += share * luminaires.unoccluded(&point);
            sum.arriving += share * luminaires.irradiance(&point);
        }
        sum
    }

    fn of_sun(&self, sun: &Sun, point: &GatherPoint) -> Direct {
        let rotation = self.rotations.at(point.position, point.near);
        let second_rotation = second_rotation(rotation);
        let (mut seen, mut all, mut rays) = (Rgb::ZERO, 0.0, 0.0);
        for (start, end) in [(0, RAYS_TO_SUN[0]), (RAYS_TO_SUN[0], RAYS_TO_SUN[1])] {
            for [x, y] in (start..end).map(sobol_02_point) {
                let towards = sun.towards([(x + second_rotation).fract(), (y + rotation).fract()]);
                let cosine = point.normal.dot(towards).max(0.0);
                let reach = point.near..f64::INFINITY;
                let is_free =
                    || !self.rays.occluded(point.position, towards, reach.clone(), |_| true);
                (all, rays) = (all + cosine, rays + 1.0);
                if cosine > 0.0 && is_free() {
                    seen += cosine * self.panes.transmittance(point.position, towards, reach);
                }
            }
            if seen == Rgb::ZERO || seen == Rgb::splat(all) {
                break;
            }
        }
        let cosine = point.normal.dot(sun.direction);
        let unoccluded = sun.unoccluded(cosine).unwrap_or(sun.irradiance * (all / rays));
        Direct { unoccluded, arriving: unoccluded * seen / f64::max(all, f64::MIN_POSITIVE) }
    }
}
