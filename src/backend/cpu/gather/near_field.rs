//! Near surfaces, whose elements are too large to resolve their light there.
//!
//! ```text
//!        ▔▔▔▔▔▔▔▔▔▔▔▔▔▔▔▔▔▔▔   one element, lit at its right end
//!          ╲ ↗ ╲
//!   ────────x───────────────►  light from outside, which reaches no further in
//! ```
//!
//! An element that is wider than it is far away covers much of the hemisphere of a point, and its
//! interpolated light may differ from the part that the point sees: in a gap, light that is
//! interpolated from its mouth would fill all of it, and be reflected between its walls. So where
//! such surfaces cover much of the hemisphere, the light that they reflect is found by paths, one a
//! ray, that end at the first surface that is further away than its element is wide (secondary
//! final gathering: Jensen 1996; Christensen 1999).

use std::sync::OnceLock;

use glam::DVec3;

use crate::gather::GatherPoint;
use crate::gather::near_surface::is_near;
use crate::light::PathTracer;
use crate::mesh::Mesh;
use crate::sampling::random::random_numbers;
use crate::scene::Rgb;
use crate::visibility::ray_scene::Hit;

/// A ray that hits a near surface.
pub(super) struct NearRay {
    pub hit: Hit,
    pub direction: DVec3,
    /// Share of the light that clear panes on the way let through.
    pub passed: Rgb,
    /// Number of the ray.
    pub ray: u32,
}

/// What a near surface reflects to a point by one path.
pub(super) struct NearLight {
    /// Light that arrives on the path, W/m².
    pub light: Rgb,
    /// The end of the path, and the share of the radiosity reflected there that arrives.
    pub end: Option<(Rgb, Hit)>,
}

/// Finds the light of near surfaces.
#[derive(Debug, Default)]
pub(super) struct NearField {
    /// None before the first point that needs it.
    paths: OnceLock<PathTracer<'static>>,
}

impl NearField {
    /// Whether paths find the light of near surfaces: where more than half of `rays` are `near`.
    /// Plain choice.
    pub fn is_covered(near: usize, rays: usize) -> bool {
        2 * near > rays
    }

    /// The light of a near surface at the end of a `ray` from `point`, where light is known on the
    /// elements of `mesh`. Numbers of the path follow from the `rotation` of the point's rays,
    /// which is the same at every scale of the scene. Paths look for emitters `by_area` too where
    /// some are small from there.
    pub fn light(
        &self,
        mesh: &Mesh,
        point: &GatherPoint,
        rotation: f64,
        ray: &NearRay,
        by_area: bool,
    ) -> NearLight {
        let paths = self.paths.get_or_init(|| PathTracer::of_shared(mesh.shared_scene()));
        let mut rng = random_numbers(&[rotation.to_bits(), u64::from(ray.ray)]);
        let position = point.position + ray.hit.distance * ray.direction;
        let ends = |hit: &Hit| !is_near(mesh, hit);
        let (light, end) = paths.path_to(&ray.hit, position, by_area, ends, &mut rng);
        NearLight { light, end }
    }
}
