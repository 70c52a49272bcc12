//! Furnaces: the radiosity is the same everywhere.

use std::f64::consts::PI;

use glam::DVec3;
use radiosity::verify::PathTracer;
use radiosity::{Backend, BakeSettings, BakeTarget, Rgb, Scene, VertexMesh};

use crate::case::{Case, Section};
use crate::scenes::{cube, facing_up, paint, quads, standing_block};
use crate::{Result, go, go_on};

/// Error that bakes are asked for.
const ASKED: f64 = 0.01;

/// Paths of the path tracer.
const PATHS: usize = 1 << 16;

pub fn section() -> Result<Section> {
    let mut cases = vec![];
    for rho in [0.2, 0.5, 0.8, 0.9, 0.95, 0.99] {
        cases.push(solved(rho)?);
    }
    for rho in [0.5, 0.9] {
        let found = baked_mean(cube(&paint(rho, 1.0)))?;
        cases.push(in_cube("bake to 1 %", rho, found, ASKED / (1.0 - rho)));
    }
    cases.push(white_furnace()?);
    for rho in [0.5, 0.9] {
        cases.push(path_traced(rho));
    }
    let bands = "Solver: the unshot share u of the emitted flux leaves ρ u of the radiosity out, \
        nearly all of which it is where the solver stops, and sums round to 1e-9. Bakes: \
        the mean is no further off than the root mean square, which is the 1 % asked for. \
        Path tracer: four standard errors.";
    Ok(Section { title: "Furnaces", bands, cases })
}

/// A closed cube whose walls emit 1 W/m²: B = 1/(1 − ρ).
fn in_cube(way: &str, rho: f64, here: f64, band: f64) -> Case {
    Case {
        name: format!("closed cube, ρ = {rho}, {way}"),
        source: "closed form, E/(1 − ρ)".into(),
        quantity: "mean radiosity, W/m²".into(),
        right: 1.0 / (1.0 - rho),
        here,
        band,
    }
}

fn solved(rho: f64) -> Result<Case> {
    let scene = cube(&paint(rho, 1.0));
    let mut settings = BakeSettings::elements_only(&scene);
    // Rows sum to one however few rays make them, and the mean does not depend on elements.
    settings.solve.element_size = 0.25;
    settings.solve.hemicube_resolution = 32;
    let baked = settings.bake(scene, &Backend::Cpu, go)?;
    let mesh = &baked.mesh;
    let area = |e: usize| mesh.area(mesh.element(e));
    let elements = 0..mesh.element_count();
    let flux: f64 = elements.clone().map(|e| baked.solution.radiosity[e].x * area(e)).sum();
    let found = flux / elements.map(area).sum::<f64>();
    let missed = rho * settings.solve.solver.unshot + 1e-9;
    Ok(in_cube("solver", rho, found, missed / (1.0 - rho)))
}

/// A block on the ground under a uniform sky of radiance 1; what surfaces do not reflect of it they
/// emit, so that all that is seen anywhere has radiance 1.
fn white_furnace() -> Result<Case> {
    let rho = 0.8;
    let block = standing_block([-0.5, 0.5], [-0.5, 0.5], 0.0, 1.0);
    let ground = facing_up([-2.0, 2.0], [-2.0, 2.0], 0.0);
    let material = paint(rho, PI * (1.0 - rho));
    let parts: Vec<_> = block.into_iter().chain([ground]).map(|q| (q, material.clone())).collect();
    Ok(Case {
        name: "white furnace: block on the ground, uniform sky".into(),
        source: "closed form, π L".into(),
        quantity: "mean radiosity, W/m²".into(),
        right: PI,
        here: baked_mean(quads(&parts).with_sky(Rgb::ONE)?)?,
        band: ASKED * PI,
    })
}

fn baked_mean(scene: Scene) -> Result<f64> {
    let baked = BakeTarget::Error(ASKED).bake(scene, &Backend::Cpu, go)?;
    Ok(mean(&baked.light.surface))
}

/// Mean radiosity of the first channel over the area.
pub fn mean(surface: &VertexMesh) -> f64 {
    let (mut flux, mut area) = (0.0, 0.0);
    for face in &surface.faces {
        let [a, b, c] = face.map(|v| surface.positions[v as usize]);
        let of_face = (b - a).cross(c - a).length() / 2.0;
        area += of_face;
        flux += of_face * face.iter().map(|&v| surface.radiosity[v as usize].x).sum::<f64>() / 3.0;
    }
    flux / area
}

fn path_traced(rho: f64) -> Case {
    let scene = cube(&paint(rho, 1.0));
    let tracer = PathTracer::new(&scene);
    let point = tracer.locate(DVec3::new(0.3, 0.4, 0.0), DVec3::Z).expect("a point of the floor");
    let found = tracer.reflected(&[point], PATHS, 1, go_on)[0];
    let band = 4.0 * found.standard_error.x + 1e-12;
    in_cube("path tracer", rho, found.radiosity.x + 1.0, band)
}
