//! Light at vertices as arrays, and what was measured of a bake.

use js_sys::{Float64Array, Uint32Array};
use radiosity::bake::{Obstacle, Outcome};
use radiosity::glam::DVec3;
use radiosity::{BakeResult, VertexMesh};
use serde_json::{Map, Value, json};
use wasm_bindgen::prelude::*;

/// Light at vertices: copies, which stay when memory grows.
#[wasm_bindgen]
#[derive(Debug)]
pub struct Light {
    positions: Float64Array,
    normals: Float64Array,
    radiosity: Float64Array,
    irradiance: Float64Array,
    error: Float64Array,
    faces: Uint32Array,
}

impl Light {
    pub fn new(surface: &VertexMesh) -> Light {
        Light {
            positions: rows(&surface.positions),
            normals: rows(&surface.normals),
            radiosity: rows(&surface.radiosity),
            irradiance: rows(&surface.irradiance),
            error: Float64Array::from(&surface.error[..]),
            faces: Uint32Array::from(surface.faces.as_flattened()),
        }
    }
}

/// Vectors one after the other.
fn rows(vectors: &[DVec3]) -> Float64Array {
    let array = Float64Array::new_with_length(3 * vectors.len() as u32);
    // In pieces: no copy of all of it is made on the way.
    for (k, piece) in vectors.chunks(4096).enumerate() {
        let numbers: Vec<f64> = piece.iter().flat_map(|v| v.to_array()).collect();
        let start = 3 * 4096 * k as u32;
        array.subarray(start, start + numbers.len() as u32).copy_from(&numbers);
    }
    array
}

#[wasm_bindgen]
impl Light {
    #[wasm_bindgen(getter)]
    pub fn positions(&self) -> Float64Array {
        self.positions.clone()
    }

    #[wasm_bindgen(getter)]
    pub fn normals(&self) -> Float64Array {
        self.normals.clone()
    }

    #[wasm_bindgen(getter)]
    pub fn radiosity(&self) -> Float64Array {
        self.radiosity.clone()
    }

    #[wasm_bindgen(getter)]
    pub fn irradiance(&self) -> Float64Array {
        self.irradiance.clone()
    }

    #[wasm_bindgen(getter)]
    pub fn error(&self) -> Float64Array {
        self.error.clone()
    }

    #[wasm_bindgen(getter)]
    pub fn faces(&self) -> Uint32Array {
        self.faces.clone()
    }
}

/// What was measured of a bake, as JSON.
pub fn report(baked: &BakeResult, is_on_gpu: bool) -> String {
    let BakeResult { estimate, outcome, light, groups, .. } = baked;
    let scene = light.mesh.scene();
    let warnings: Vec<String> = scene.warnings().iter().map(ToString::to_string).collect();
    let of_groups: Map<String, Value> = groups
        .iter()
        .map(|g| (scene.groups()[g.group as usize].clone(), g.estimate.total.into()))
        .collect();
    json!({
        "error": estimate.total,
        "errorParts": {
            "mesh": estimate.mesh,
            "sampling": estimate.sampling,
            "truncation": estimate.truncation,
            "unshot": estimate.unshot,
            "sources": estimate.sources,
            "tail": estimate.tail,
        },
        "errorOfGroups": of_groups,
        "reached": matches!(outcome, Outcome::Reached | Outcome::Unasked),
        "stopped": matches!(outcome, Outcome::Missed(Obstacle::Cancelled)),
        "outcome": outcome.to_string(),
        "vertices": light.surface.positions.len(),
        "triangles": scene.triangles().len(),
        "gathers": light.gather_count,
        "up": scene.up().to_array(),
        "device": if is_on_gpu { "gpu" } else { "cpu" },
        "deviceFailure": baked.device_failure.as_ref().map(ToString::to_string),
        "warnings": warnings,
    })
    .to_string()
}
