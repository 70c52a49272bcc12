//! View factors between polygons.

use std::f64::consts::PI;

use glam::DVec3;
use radiosity::form_factor::closed_form::point_to_polygon;
use radiosity::{Material, Scene, Triangle, ViewFactors, load_scene};
use serde_json::Value;

use crate::case::{Case, Section};
use crate::{Result, file, go_on};

/// Of contour integrals, of the share of the larger area.
const ROUNDING: f64 = 1e-12;

const FOLDER: &str = "tests/data/view_factors";

pub fn section() -> Result<Section> {
    let text = std::fs::read_to_string(file(FOLDER).join("expected.json"))?;
    let listed: Vec<Value> = serde_json::from_str(&text)?;
    let mut known: Option<(String, ViewFactors)> = None;
    let mut cases = vec![];
    for case in &listed {
        let text = |key: &str| case[key].as_str().unwrap_or_default().to_string();
        let uncertainty = number(&case["uncertainty"])?;
        let (here, error) = match case.get("differential") {
            // Closed forms round by 1e-14 for each triangle.
            Some(differential) => (of_point(case, &differential["dA"])?, 2e-14),
            None => between_groups(case, &mut known)?,
        };
        cases.push(Case {
            name: text("description"),
            source: source(&text("source")),
            quantity: format!("F {} → {}", text("from"), text("to")),
            right: number(&case["value"])?,
            here,
            band: error + uncertainty,
        });
    }
    cases.extend(concentric_spheres()?);
    let bands = "Four standard errors, as stated, but no more than the error that is asked for \
        (1e-4; 1e-2 for the listed concentric spheres), rounding of contour integrals \
        (1e-12), and what is known of the truth. Points: rounding of the closed form. \
        Right values are those of tests/data/view_factors/expected.json: closed forms, \
        contour integrals and exact shadows of the polygons as given, to 40 digits where \
        there is no shadow; sources name the geometry.";
    Ok(Section { title: "View factors", bands, cases })
}

/// Where a case of the list is from, without what it says of the value.
fn source(text: &str) -> String {
    let text = text.replace("(own implementation, 40-digit mpmath)", "");
    let text = text.replace("own reference (this research): ", "").replace(" :", ":");
    text.split(';').next().and_then(|text| text.split(" (").next()).unwrap_or_default().into()
}

fn number(value: &Value) -> Result<f64> {
    Ok(value.as_f64().ok_or("expected.json: not a number")?)
}

fn scene_of(case: &Value) -> Result<Scene> {
    Ok(load_scene(file(FOLDER).join(case["obj"].as_str().ok_or("expected.json: no \"obj\"")?))?)
}

/// From a point to a group.
fn of_point(case: &Value, place: &Value) -> Result<f64> {
    let vector = |key: &str| -> Result<DVec3> {
        let [x, y, z] = [0, 1, 2].map(|k| number(&place[key][k]));
        Ok(DVec3::new(x?, y?, z?))
    };
    let (point, normal, scene) = (vector("point")?, vector("normal")?, scene_of(case)?);
    let to = scene.groups().iter().position(|group| case["to"] == **group).ok_or("no group")?;
    let triangles =
        (0..scene.triangles().len()).filter(|&t| scene.triangles()[t].group == to as u32);
    Ok(triangles.map(|t| point_to_polygon(point, normal, &scene.corners(t))).sum())
}

/// The factor between two groups, and by how much it may be off. `known` has those of the last
/// file.
fn between_groups(case: &Value, known: &mut Option<(String, ViewFactors)>) -> Result<(f64, f64)> {
    let obj = case["obj"].to_string();
    // Over a hundred thousand pairs with a sphere in between: larger, for the time it takes.
    let asked = if obj.contains("concentric-spheres") { 1e-2 } else { 1e-4 };
    if known.as_ref().is_none_or(|(name, _)| *name != obj) {
        let factors = ViewFactors::exact(&scene_of(case)?, asked, &[], go_on)?;
        *known = Some((obj, factors.ok_or("stopped")?));
    }
    let (_, factors) = known.as_ref().ok_or("no factors")?;
    let group = |key: &str| factors.names.iter().position(|name| case[key] == **name);
    let from = group("from").ok_or("no group")?;
    let found = match group("to") {
        Some(to) => factors.factor(from, to),
        None => factors.open[from],
    };
    Ok((found.value, (4.0 * found.error).min(asked) + ROUNDING))
}

/// A sphere in one of twice its radius, both of the same facets: the inner one is convex and sees
/// the outer one alone; a quarter of what leaves the outer one meets the inner one.
fn concentric_spheres() -> Result<Vec<Case>> {
    let factors = ViewFactors::sparse(&spheres(), 1e-4, &[], go_on)?.ok_or("stopped")?;
    let case = |from: usize, to: usize, right: f64| {
        let found = factors.factor(from, to);
        Case {
            name: "concentric spheres of the same 264 facets, radii 1 and 2".into(),
            source: "closed form, A₁/A₂".into(),
            quantity: format!("F {} → {}", factors.names[from], factors.names[to]),
            right,
            here: found.value,
            band: 4.0 * found.error + ROUNDING,
        }
    };
    Ok(vec![case(0, 1, 1.0), case(1, 0, 0.25), case(1, 1, 0.75)])
}

/// The inner sphere seen from outside, and the outer one seen from inside.
pub fn spheres() -> Scene {
    const RINGS: u32 = 12;
    let (mut positions, mut triangles) = (vec![], vec![]);
    for (group, radius) in [(0, 1.0), (1, 2.0)] {
        let first = positions.len() as u32;
        for ring in 0..=RINGS {
            let (sine, z) = (PI * f64::from(ring) / f64::from(RINGS)).sin_cos();
            for k in 0..RINGS {
                let (y, x) = (2.0 * PI * f64::from(k) / f64::from(RINGS)).sin_cos();
                positions.push(radius * DVec3::new(sine * x, sine * y, z));
            }
        }
        let at = |ring: u32, k: u32| first + RINGS * ring + k % RINGS;
        let mut add = |mut corners: [u32; 3]| {
            if group == 1 {
                corners.reverse();
            }
            triangles.push(Triangle { corners, group, material: 0, smoothing: None });
        };
        for (ring, k) in (0..RINGS).flat_map(|ring| (0..RINGS).map(move |k| (ring, k))) {
            let [a, b, c, d] = [at(ring, k), at(ring + 1, k), at(ring + 1, k + 1), at(ring, k + 1)];
            // At the poles one of the two has no area.
            if ring + 1 < RINGS {
                add([a, b, c]);
            }
            if ring > 0 {
                add([a, c, d]);
            }
        }
    }
    let names = ["inner", "outer"].map(String::from).to_vec();
    Scene::new(positions, triangles, names, vec![Material::grey("grey", 0.5)]).expect("a scene")
}
