//! Scenes at points that were path traced with Mitsuba 3.

use radiosity::{Backend, BakeTarget, VertexMesh, load_scene};

use crate::case::{Case, Section};
use crate::{Result, file, go, truth};

const SOURCE: &str = "path traced, Mitsuba 3";

/// A scene with values at points.
struct Traced {
    name: &'static str,
    scene: &'static str,
    truth: &'static str,
    /// Error that the bake is asked for.
    asked: f64,
    /// Standard error of a value of the truth, a share of it: the median over the points.
    noise: f64,
}

const SCENES: [Traced; 3] = [
    Traced {
        name: "Cornell box",
        scene: "scenes/cornell_box.obj",
        truth: "tests/data/cornell_box.truth.json",
        asked: 0.02,
        noise: 0.001,
    },
    Traced {
        name: "two rooms and a door",
        scene: "examples/verification/data/two_room.obj",
        truth: "examples/verification/data/two_room.truth.json",
        asked: 0.05,
        noise: 0.003,
    },
    Traced {
        name: "room with a window, uniform sky",
        scene: "examples/verification/data/window_room.obj",
        truth: "examples/verification/data/window_room.truth.json",
        asked: 0.05,
        noise: 0.003,
    },
];

pub fn section() -> Result<Section> {
    let mut cases = vec![];
    for traced in &SCENES {
        let scene = load_scene(file(traced.scene))?.resolve_sides();
        let baked = BakeTarget::Error(traced.asked).bake(scene, &Backend::Cpu, go)?;
        let text = std::fs::read_to_string(file(traced.truth))?;
        let surface = &baked.light.surface;
        cases.push(Case {
            name: format!("{}, all points over the area", traced.name),
            source: SOURCE.into(),
            quantity: "RMS of relative errors".into(),
            right: 0.0,
            here: truth::area_error(surface, &text),
            band: traced.asked,
        });
        cases.extend(traced.points(surface, &text)?);
    }
    let bands = "All points: the 2 % or 5 % that the bake is asked for, which is the root mean \
        square over 99 % of the area. Single points, every tenth: twice the error that the \
        bake states there, which is two standard errors, and four times the noise of the \
        truth, 0.1 % in the Cornell box and 0.3 % in the others.";
    Ok(Section { title: "Path-traced scenes", bands, cases })
}

impl Traced {
    /// Every tenth point over the area.
    fn points(&self, surface: &VertexMesh, text: &str) -> Result<Vec<Case>> {
        let points = truth::points(text)?;
        let chosen = points.iter().filter(|point| point.kind == "area").step_by(10);
        chosen.map(|point| self.point(surface, point)).collect()
    }

    fn point(&self, surface: &VertexMesh, point: &truth::Point) -> Result<Case> {
        let (found, stated) = truth::at(surface, point.position, point.normal).ok_or("no face")?;
        let right = point.radiosity.element_sum() / 3.0;
        let [x, y, z] = point.position.to_array();
        Ok(Case {
            name: format!("{}, at ({x:.1}, {y:.1}, {z:.1})", self.name),
            source: SOURCE.into(),
            quantity: "radiosity, W/m²".into(),
            right,
            here: found.element_sum() / 3.0,
            band: (2.0 * stated).hypot(4.0 * self.noise * right),
        })
    }
}
