//! Light from known directions, that of the sun and of luminaires, at points of surfaces: by rays.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::GatherPoint;
use super::light_tree::LightTree;
use super::luminaire_light::{LuminaireLight, SMALL_BOUND};
use super::two_sided::TwoSidedPoint;
use super::visible::Visible;
use crate::sampling::rotation::CellRotation;
use crate::scene::{Luminaire, Rgb, Scene, Sun};
use crate::visibility::panes::Panes;
use crate::visibility::ray_scene::RayScene;

/// Rays to the disc of the sun: at first, and where some are free and some are not. A penumbra then
/// has 64 steps, of 1.6 % of the light.
const RAYS_TO_SUN: [u32; 2] = [8, 64];

/// The sun and the luminaires of a scene, and what rays to them meet.
#[derive(Debug)]
pub(crate) struct DirectionalLight {
    scene: Arc<Scene>,
    luminaires: Arc<LightTree<Luminaire>>,
    rays: Arc<RayScene>,
    panes: Panes,
    rotations: CellRotation,
}

/// What that light adds to the reflected radiosity of a vertex, W/m² per channel.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Direct {
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
            luminaires: LightTree::of_luminaires(&scene),
            rays: RayScene::of_scene(&scene),
            panes: Panes::of_scene(&scene),
            rotations: CellRotation::new(&scene.bounds()),
            scene,
        })
    }

    /// What it adds to the reflected radiosity of a surface of this `albedo` at `point`, where it
    /// causes the irradiance `arriving` (W/m²), if that is known; else rays are cast for it.
    pub fn reflected(&self, albedo: Rgb, point: &TwoSidedPoint, arriving: Option<Rgb>) -> Direct {
        let arriving = arriving.unwrap_or_else(|| self.irradiance(point));
        Direct { unoccluded: albedo * self.unoccluded(point), arriving: albedo * arriving }
    }

    /// Irradiance that it would cause at `point` if nothing were in its way, W/m² per channel.
    fn unoccluded(&self, point: &TwoSidedPoint) -> Rgb {
        let of_sun = |point: &GatherPoint| match self.scene.sky().sun() {
            Some(sun) => {
                let cosine = point.normal.dot(sun.direction);
                sun.unoccluded(cosine).unwrap_or(sun.irradiance * cosine.max(0.0))
            }
            None => Rgb::ZERO,
        };
        on_both_sides(point, |point| of_sun(point) + self.luminaires().unoccluded(point))
    }

    /// Irradiance that it causes at `point`, W/m² per channel.
    fn irradiance(&self, point: &TwoSidedPoint) -> Rgb {
        let sun = self.scene.sky().sun();
        on_both_sides(point, |point| {
            let of_sun = sun.map_or(Rgb::ZERO, |sun| self.of_sun(sun, point));
            of_sun + self.luminaires().irradiance(point, SMALL_BOUND).irradiance
        })
    }

    /// Irradiance that luminaires cause at `point`, W/m² per channel, coarsely where they are many:
    /// the source of further bounces.
    pub fn of_luminaires(&self, point: &GatherPoint) -> Rgb {
        self.luminaires().coarse_irradiance(point)
    }

    fn luminaires(&self) -> LuminaireLight<'_> {
        LuminaireLight {
            luminaires: self.scene.luminaires(),
            tree: &self.luminaires,
            rays: &self.rays,
            panes: &self.panes,
            rotations: &self.rotations,
        }
    }

    fn of_sun(&self, sun: &Sun, point: &GatherPoint) -> Rgb {
        let rotation = self.rotations.at(point.position, point.near);
        let rays = |range| Visible::of_sun(sun, point, rotation, range, &self.rays, &self.panes);
        let [few, all] = RAYS_TO_SUN;
        let mut visible = rays(0..few);
        if visible.is_partial() {
            visible.add(&rays(few..all));
        }
        visible.irradiance_of_sun(sun, point)
    }
}

/// `irradiance` on the sides of `point`, by their shares.
fn on_both_sides(point: &TwoSidedPoint, irradiance: impl Fn(&GatherPoint) -> Rgb) -> Rgb {
    let [front, behind] = point.shares();
    let of_front = front * irradiance(&point.point);
    if behind == Rgb::ZERO { of_front } else { of_front + behind * irradiance(&point.other_side()) }
}
