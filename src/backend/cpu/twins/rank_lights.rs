//! Twin of `shaders/rank_lights.wgsl`: selects the lights that are sampled separately from a point.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

use super::gather_state::added_up;
use super::lights::{from_point, sobol, to_light};
use crate::backend::cpu::gather::RAYS_PER_SHADOW_RAY;
use crate::backend::gpu::layout::{
    EVENNESS_POINTS, GatherSettings, LANES, MIN_IRRADIANCE_SHARE, MIN_RAYS, PointState,
    RankedLight, TracedLight, TracedPoint, TracedTriangle,
};
use crate::backend::gpu::traced_scene::TracedArrays;
use crate::gather::lights::MAX_EXPLICIT_LIGHTS;

/// n · Γ of one side of a polygon seen from the origin: its angle times the cosine of its plane.
pub fn side(a: Vec3, b: Vec3, normal: Vec3) -> f32 {
    let across = a.cross(b - a);
    let sine = across.length();
    sine.atan2(a.dot(b)) * normal.dot(across) / sine.max(1e-37)
}

/// The part of a triangle visible from a point that it faces.
#[derive(Debug)]
pub enum Seen {
    /// It is turned away.
    Back,
    /// It is so small that its middle represents it: its form factor.
    Small(f32),
    /// Its corners, clipped at the horizon.
    Cut(Vec<Vec3>),
}

pub fn seen(t: &TracedTriangle, point: &TracedPoint) -> Seen {
    let [edge_u, edge_v, normal] = [t.edge_u, t.edge_v, point.normal].map(Vec3::from);
    let a = from_point(point, t.corner, t.corner_low);
    let area_normal = edge_u.cross(edge_v);
    if area_normal.dot(a) >= 0.0 {
        return Seen::Back;
    }
    let middle = a + (edge_u + edge_v) / 3.0;
    let square = middle.dot(middle);
    if t.extent * t.extent < 2.5e-5 * square {
        let cosines = -area_normal.dot(middle) * normal.dot(middle).max(0.0);
        return Seen::Small(0.5 * cosines / (PI * square * square));
    }
    let corners = [a, a + edge_u, a + edge_v];
    let mut cut = vec![];
    for k in 0..3 {
        let (p, q) = (corners[k], corners[(k + 1) % 3]);
        let (height, next) = (normal.dot(p), normal.dot(q));
        if height >= 0.0 {
            cut.push(p);
        }
        if (height >= 0.0) != (next >= 0.0) {
            cut.push(p + (q - p) * (height / (height - next)));
        }
    }
    Seen::Cut(cut)
}

/// The form factor from a point to a triangle that faces it: Lambert's formula for the part above
/// the horizon (Baum, Rushmeier and Winget 1989, eq. 8).
pub fn to_triangle(t: &TracedTriangle, point: &TracedPoint) -> f32 {
    match seen(t, point) {
        Seen::Back => 0.0,
        Seen::Small(factor) => factor,
        Seen::Cut(corners) => {
            let next = corners.iter().cycle().skip(1);
            let normal = point.normal.into();
            let sum: f32 = corners.iter().zip(next).map(|(&a, &b)| side(a, b, normal)).sum();
            // Fronts are clockwise as seen from the point.
            (-sum / (2.0 * PI)).max(0.0)
        }
    }
}

/// The triangles of a light.
pub fn triangles<'a>(
    scene: &'a TracedArrays,
    light: &TracedLight,
) -> impl Iterator<Item = &'a TracedTriangle> {
    let lamps = &scene.lamps[light.first as usize..(light.first + light.count) as usize];
    lamps.iter().map(|lamp| &scene.triangles[lamp.triangle as usize])
}

/// The form factor from a point to a light.
pub fn factor_of(scene: &TracedArrays, light: &TracedLight, point: &TracedPoint) -> f32 {
    triangles(scene, light).map(|t| to_triangle(t, point)).sum()
}

/// Irradiance by a light of this form factor, in its brightest channel.
pub fn irradiance_of(light: &TracedLight, factor: f32) -> f32 {
    factor * Vec3::from(light.exitance).max_element()
}

/// The state of a point before the first ray.
pub fn rank_lights(
    scene: &TracedArrays,
    point: &TracedPoint,
    settings: &GatherSettings,
) -> PointState {
    let lights = &scene.lights[..scene.info.lights as usize];
    let mut all_irradiance = 0.0;
    let mut ranked: Vec<(RankedLight, f32)> = vec![];
    for (number, light) in (0..).zip(lights) {
        let factor = factor_of(scene, light, point);
        let irradiance = irradiance_of(light, factor);
        all_irradiance += irradiance;
        // Ties are ordered by number.
        if irradiance > 0.0 {
            let at = ranked.iter().take_while(|other| other.1 >= irradiance).count();
            let light = RankedLight { light: number, factor, ..Default::default() };
            ranked.insert(at, (light, irradiance));
            ranked.truncate(MAX_EXPLICIT_LIGHTS);
        }
    }
    ranked.retain(|light| light.1 > MIN_IRRADIANCE_SHARE * all_irradiance);
    let mut state = PointState {
        ray_count: settings.min_rays,
        shadow_count: (settings.min_rays / RAYS_PER_SHADOW_RAY).max(2),
        pending: 3,
        ..Default::default()
    };
    for (mut of_light, _) in ranked {
        let light = &lights[of_light.light as usize];
        of_light.is_wide = is_wide(scene, light, point, of_light.factor, settings).into();
        // A wide light without a closed form is treated like any surface.
        if of_light.is_wide == 0 || light.is_convex != 0 {
            state.lights[state.light_count as usize] = of_light;
            state.light_count += 1;
        }
    }
    state
}

/// Whether rays over the hemisphere estimate a light's visible share better than rays to it.
fn is_wide(
    scene: &TracedArrays,
    light: &TracedLight,
    point: &TracedPoint,
    factor: f32,
    settings: &GatherSettings,
) -> bool {
    let mut weights = [Vec2::ZERO; LANES as usize];
    for lane in 0..EVENNESS_POINTS {
        let weight = to_light(scene, light, point, sobol(lane)).factor;
        weights[lane as usize] = Vec2::new(weight, weight * weight);
    }
    let sum = added_up(weights, |sum, term| *sum += term);
    // Points of weights w have the effective number (Σ w)² / Σ w² (Kish 1965, section 11.7).
    let worth = sum.x * sum.x / (sum.y * EVENNESS_POINTS as f32).max(1e-37);
    settings.min_rays as f32 * factor >= MIN_RAYS && factor * RAYS_PER_SHADOW_RAY as f32 > worth
}
