//! Radiosity of a solution at points: interpolated over its face there.

use std::f64::consts::PI;

use glam::DVec3;

use crate::error::{Error, ErrorKind, shortened};
use crate::light::{SurfacePoint, nearest_surfaces};
use crate::scene::{Material, Rgb, Scene};
use crate::vertex::{FacePlace, VertexMesh};
use crate::visibility::ray_scene::{Hit, RayScene};

/// Exitance of the solution on the triangles of a material.
#[derive(Clone, Copy, Default)]
struct Emission {
    points: usize,
    /// Whether it is that of the material at any of the points.
    agrees: bool,
    /// At the last of them, W/m².
    exitance: Rgb,
}

/// The error that a solution emits the `exitance` (W/m²), and not that of a scene's `material`.
fn other_emission(material: &Material, exitance: Rgb) -> Error {
    // Four digits: the vertices of a file are no more exact.
    let digits = |x: f64| format!("{x:.3e}").parse().unwrap_or(x).to_string();
    let radiance = |exitance: Rgb| {
        let channels = exitance.max(Rgb::ZERO) / PI;
        channels.to_array().map(digits).join(",")
    };
    let emitted = radiance(exitance);
    let name = shortened(&material.name);
    let found = format!(
        "its material '{name}' emits radiance {emitted}, and {} in the scene",
        radiance(material.exitance)
    );
    let remedy = format!(
        "verify it with the reflectances and lamps it had, such as --emit {name}={emitted}"
    );
    Error::new(ErrorKind::Scene, "solution", found, remedy)
}

/// Whether `material` has this radiosity under this irradiance, W/m², to 0.1 %: files have six
/// digits, and vertices at the edge of light may be smoothed.
fn is_light_of(material: &Material, radiosity: Rgb, irradiance: Rgb) -> bool {
    let reflected = material.albedo() * irradiance;
    let noise = 1e-3 * radiosity.max_element().max(reflected.max_element());
    (radiosity - reflected).abs_diff_eq(material.exitance, noise)
}

/// Radiosity on the surfaces of a scene.
pub(crate) trait Solution: Sync {
    /// Radiosity that `point` of `scene` reflects with the reflectance of its material, W/m². None
    /// where the solution has no face.
    fn reflected(&self, scene: &Scene, point: &SurfacePoint) -> Option<Rgb>;

    /// Number of vertices.
    fn vertices(&self) -> usize;
}

/// Any mesh of vertices as a solution: its faces are found by rays.
pub(super) struct SolutionLookup<'a> {
    solution: &'a VertexMesh,
    rays: RayScene,
    normals: Vec<DVec3>,
    /// Of the scene, scene unit.
    diagonal: f64,
}

impl<'a> SolutionLookup<'a> {
    /// Checks `solution`, of `scene`: see [`SolutionLookup::check_emission`].
    pub fn new(solution: &'a VertexMesh, scene: &Scene) -> Result<SolutionLookup<'a>, Error> {
        let diagonal = scene.bounds().diagonal();
        let VertexMesh { positions, radiosity, irradiance, faces, .. } = solution;
        let wrong = |found: String, remedy: &str| {
            Err(Error::new(ErrorKind::Scene, "solution", found, remedy))
        };
        let (vertices, values) = (positions.len(), radiosity.len());
        if vertices != values {
            let found = format!("{values} values of radiosity at {vertices} vertices");
            return wrong(found, "give one for each");
        }
        if scene.has_textures() && irradiance.len() != vertices {
            let found = format!("{} values of irradiance at {vertices} vertices", irradiance.len());
            return wrong(found, "give one for each, as `bake` writes them: there are textures");
        }
        let unknown = irradiance.iter().position(|e| !e.is_finite());
        if let Some(v) = unknown.filter(|_| scene.has_textures()) {
            let found = format!("vertex {} with irradiance {}", v + 1, irradiance[v]);
            return wrong(found, "all numbers must be finite");
        }
        let finite = |(p, b): (&DVec3, &Rgb)| p.is_finite() && b.is_finite();
        if let Some(v) = positions.iter().zip(radiosity).position(|pair| !finite(pair)) {
            let found = format!("vertex {} at {} with {}", v + 1, positions[v], radiosity[v]);
            return wrong(found, "all numbers must be finite");
        }
        let outside = |face: &[u32; 3]| face.iter().any(|&v| v as usize >= vertices);
        if let Some(f) = faces.iter().position(outside) {
            let found = format!("face {} of vertices {:?}", f + 1, faces[f]);
            return wrong(found, "indices must be below the number of vertices");
        }
        if faces.is_empty() {
            return wrong("no faces".into(), "give the whole surface of the scene");
        }
        let corners = |face: &[u32; 3]| face.map(|v| positions[v as usize]);
        let normal = |face| {
            let [a, b, c] = corners(face);
            let scale = (b - a).abs().max((c - a).abs()).max_element().max(f64::MIN_POSITIVE);
            ((b - a) / scale).cross((c - a) / scale).normalize_or_zero()
        };
        let rays = RayScene::new(faces.iter().map(corners));
        let normals = faces.iter().map(normal).collect();
        let lookup = SolutionLookup { solution, rays, normals, diagonal };
        lookup.check_emission(scene)?;
        Ok(lookup)
    }

    /// Refuses a solution whose surfaces emit something else than those of `scene`: what a vertex
    /// emits is its radiosity less its irradiance times the reflectance. A material is refused
    /// where that differs at every point that is looked up, 64 of each material or more. What has a
    /// texture is not looked at: its vertices have means.
    ///
    /// # Errors
    /// [`ErrorKind::Scene`] with the material and what it emits in both.
    fn check_emission(&self, scene: &Scene) -> Result<(), Error> {
        if !self.has_irradiance() {
            return Ok(());
        }
        let mut of_materials = vec![Emission::default(); scene.materials().len()];
        for (t, triangle) in scene.triangles().iter().enumerate() {
            let emission = &mut of_materials[triangle.material as usize];
            if emission.agrees || emission.points >= 64 || scene.textures(t).is_some() {
                continue;
            }
            let material = scene.material(t);
            for (radiosity, irradiance) in self.light(scene, t) {
                emission.agrees |= is_light_of(material, radiosity, irradiance);
                emission.points += 1;
                emission.exitance = radiosity - material.albedo() * irradiance;
            }
        }
        for (emission, material) in of_materials.iter().zip(scene.materials()) {
            if emission.points > 0 && !emission.agrees {
                return Err(other_emission(material, emission.exitance));
            }
        }
        Ok(())
    }

    /// Radiosity and irradiance of the solution at the centre of triangle `t` of `scene` and
    /// half-way from there to its corners, W/m².
    fn light(&self, scene: &Scene, t: usize) -> impl Iterator<Item = (Rgb, Rgb)> {
        let corners = scene.corners(t);
        let centre = corners.into_iter().sum::<DVec3>() / 3.0;
        let points = [centre].into_iter().chain(corners.map(|c| centre.midpoint(c)));
        points.filter_map(move |position| {
            let place = self.face(scene, &SurfacePoint { triangle: t, position })?;
            Some(self.light_at(&place))
        })
    }

    /// The place on the solution at `point` of `scene`: the nearest face that faces alike. Of
    /// several in one place it is the first whose light is the material's.
    fn face(&self, scene: &Scene, point: &SurfacePoint) -> Option<FacePlace> {
        let (position, normal) = (point.position, scene.normal(point.triangle));
        let hits = nearest_surfaces(&self.rays, &self.normals, position, normal, self.diagonal);
        let place = |hit: &Hit| FacePlace { face: hit.triangle, weights: [hit.u, hit.v] };
        let faces: Vec<FacePlace> = hits.iter().map(place).collect();
        if faces.len() < 2 || !self.has_irradiance() {
            return faces.into_iter().next();
        }
        let material = scene.material(point.triangle);
        let is_of_material = |place: &&FacePlace| {
            let (radiosity, irradiance) = self.light_at(place);
            is_light_of(material, radiosity, irradiance)
        };
        faces.iter().find(is_of_material).or(faces.first()).copied()
    }

    /// Whether there is an irradiance for every vertex.
    fn has_irradiance(&self) -> bool {
        self.solution.irradiance.len() == self.solution.positions.len()
    }

    /// Radiosity and irradiance at a place of the solution, W/m².
    fn light_at(&self, place: &FacePlace) -> (Rgb, Rgb) {
        let VertexMesh { radiosity, irradiance, .. } = self.solution;
        (self.solution.value_at(place, radiosity), self.solution.value_at(place, irradiance))
    }
}

impl Solution for SolutionLookup<'_> {
    fn reflected(&self, scene: &Scene, point: &SurfacePoint) -> Option<Rgb> {
        let place = self.face(scene, point)?;
        Some(self.solution.reflected_at(scene, point.triangle, &place))
    }

    fn vertices(&self) -> usize {
        self.solution.positions.len()
    }
}
