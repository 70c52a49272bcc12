//! Calls of the caller's functions while a bake works.

use std::ops::ControlFlow;
use std::sync::Arc;

use js_sys::{Date, Function};
use radiosity::bake::BakeProgress;
use radiosity::glam::DVec3;
use radiosity::{Camera, GatheredMesh, Mesh, Rgb, Scene};
use serde_json::{Value, json};
use wasm_bindgen::JsValue;

use crate::light::Light;

/// Milliseconds between calls with progress.
const INTERVAL: f64 = 50.0;

/// Width over height of the picture that the camera of light is for.
const ASPECT: f64 = 1.5;

/// The caller's functions.
pub struct Callbacks {
    progress: Function,
    light: Function,
    start: f64,
    last: f64,
    error: Option<f64>,
    is_stopped: bool,
}

impl Callbacks {
    pub fn new(progress: Function, light: Function) -> Callbacks {
        Callbacks { progress, light, start: Date::now(), last: 0.0, error: None, is_stopped: false }
    }

    /// Passes on what a bake reports; stops it where a function answers `false` or throws.
    pub fn hear(&mut self, progress: &BakeProgress) -> ControlFlow<()> {
        let share = |done: usize, of: usize| (of > 0).then(|| done as f64 / of as f64);
        match progress {
            BakeProgress::Light { light, estimate } => {
                self.show("light", light, estimate.map(|e| e.total))
            }
            BakeProgress::Estimated(estimate) => {
                self.error = Some(estimate.total);
                self.say("estimated", None, true)
            }
            BakeProgress::Shooting(_) => self.say("shooting", None, false),
            BakeProgress::Gathering(p) => self.say("gathering", share(p.gathered, p.total), false),
            BakeProgress::Estimating { samples, of } => {
                self.say("estimating", share(*samples, *of), false)
            }
            BakeProgress::DeviceFailed(error) => {
                self.say(&format!("device failed, rays on the CPU: {error}"), None, true)
            }
            _ => self.say("baking", None, false),
        }
    }

    /// Shows the surfaces of a scene before there is light: their reflectance, by which way they
    /// face.
    pub fn show_shape(&mut self, scene: &Arc<Scene>) {
        let Ok(mesh) = Mesh::new(scene.clone(), f64::INFINITY) else { return };
        let shade = |e: usize| {
            let node = mesh.element(e);
            // Plain choice: faces along the axes differ.
            let facing = mesh.normal(node).dot(DVec3::new(0.36, 0.48, 0.8)).abs();
            let triangle = scene.triangles()[mesh.triangle(node)];
            scene.materials()[triangle.material as usize].reflectance * (0.4 + 0.6 * facing)
        };
        let shaded: Vec<Rgb> = (0..mesh.element_count()).map(shade).collect();
        if let Ok(light) = GatheredMesh::from_elements(&mesh, &shaded) {
            // A stop is heard at the next report.
            let _ = self.show("shape", &light, None);
        }
    }

    /// Calls the function of light, with a camera that frames it.
    fn show(&mut self, stage: &str, light: &GatheredMesh, error: Option<f64>) -> ControlFlow<()> {
        let Camera { eye, target, up, vertical_fov } = Camera::framing(light, ASPECT);
        let mut state = self.state(stage, None, error);
        state["camera"] = json!({
            "eye": eye.to_array(),
            "target": target.to_array(),
            "up": up.to_array(),
            "fov": vertical_fov,
        });
        let light = JsValue::from(Light::new(&light.surface));
        self.answer(self.light.call2(&JsValue::NULL, &light, &state.to_string().into()))
    }

    /// Calls the function of progress, unless that was a moment ago.
    fn say(&mut self, stage: &str, done: Option<f64>, always: bool) -> ControlFlow<()> {
        let now = Date::now();
        if !always && now - self.last < INTERVAL {
            return self.flow();
        }
        self.last = now;
        let state = self.state(stage, done, self.error).to_string();
        self.answer(self.progress.call1(&JsValue::NULL, &state.into()))
    }

    fn state(&self, stage: &str, done: Option<f64>, error: Option<f64>) -> Value {
        let seconds = (Date::now() - self.start) / 1000.0;
        json!({ "stage": stage, "done": done, "error": error, "seconds": seconds })
    }

    fn answer(&mut self, answer: Result<JsValue, JsValue>) -> ControlFlow<()> {
        self.is_stopped |= answer.map_or(true, |answer| answer == JsValue::FALSE);
        self.flow()
    }

    /// Once stopped it stays so, whatever is reported later.
    fn flow(&self) -> ControlFlow<()> {
        if self.is_stopped { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}
