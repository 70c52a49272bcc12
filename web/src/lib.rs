//! What the package for JavaScript is made of: a bake of bytes, and its light as arrays and files.
//!
//! ```text
//!   bytes, options (JSON) ─► task ─► Bake ─► arrays, PLY, GLB
//!                             └─ calls back with progress, and with light as it gets better
//! ```

mod callbacks;
mod light;
mod options;
#[cfg(target_family = "wasm")]
mod suspend;
mod task;

use radiosity::io::{GlbSettings, Input, ToneCurve, write_lit_gltf};
use radiosity::{Backend, BakeResult, BakeSettings, Error, solver, write_glb, write_ply};
use wasm_bindgen::prelude::*;

use light::Light;

/// Shows panics where programs look for errors.
#[wasm_bindgen(start)]
fn start() {
    #[wasm_bindgen]
    extern "C" {
        #[wasm_bindgen(js_namespace = console, js_name = error)]
        fn console_error(text: &str);
    }
    std::panic::set_hook(Box::new(|info| console_error(&format!("radiosity: {info}"))));
}

/// The version of the crate.
#[wasm_bindgen]
pub fn version() -> String {
    env!("CARGO_PKG_VERSION").into()
}

/// A file and those that it names, which a scene is read of.
#[wasm_bindgen]
#[derive(Debug)]
pub struct Files {
    name: String,
    content: Vec<u8>,
    others: Vec<(String, Vec<u8>)>,
}

#[wasm_bindgen]
impl Files {
    /// The scene's file.
    #[wasm_bindgen(constructor)]
    pub fn new(name: String, content: Vec<u8>) -> Files {
        Files { name, content, others: vec![] }
    }

    /// Adds a file that it can name.
    pub fn add(&mut self, name: String, content: Vec<u8>) {
        self.others.push((name, content));
    }
}

impl Files {
    pub(crate) fn with<T>(&self, read: impl FnOnce(Input<'_>) -> T) -> T {
        let others: Vec<(&str, &[u8])> =
            self.others.iter().map(|(name, content)| (&**name, &**content)).collect();
        read(Input::bytes(&self.name, &self.content).with_files(&others))
    }
}

/// A bake, and what it came to.
#[wasm_bindgen]
#[derive(Debug)]
pub struct Bake {
    files: Files,
    baked: BakeResult,
    is_on_gpu: bool,
}

#[wasm_bindgen]
impl Bake {
    /// What was measured of it, as JSON.
    pub fn report(&self) -> String {
        light::report(&self.baked, self.is_on_gpu)
    }

    /// Light at vertices.
    pub fn light(&self) -> Light {
        Light::new(&self.baked.light.surface)
    }

    /// Light after at most so many reflections, at the corners of the elements that were shot on.
    pub fn bounces(&self, count: u32) -> Result<Light, JsError> {
        let scene = self.baked.light.mesh.shared_scene();
        let mut settings = BakeSettings::for_error(0.1, &scene);
        settings.gather = None;
        settings.solve.solver = solver::Solver::new(solver::Method::Jacobi);
        settings.solve.solver.max_steps = Some(count.into());
        let baked = settings.bake(scene, &Backend::Cpu, |_| std::ops::ControlFlow::Continue(()));
        Ok(Light::new(&baked.map_err(js)?.light.surface))
    }

    /// The PLY file that the program writes.
    pub fn ply(&self) -> Result<Vec<u8>, JsError> {
        let mut bytes = vec![];
        write_ply(&mut bytes, &self.baked.light.surface).map_err(js)?;
        Ok(bytes)
    }

    /// A GLB file in the light's colours: of a glTF scene the same file with light at its vertices.
    pub fn glb(&self) -> Result<Vec<u8>, JsError> {
        let light = &self.baked.light;
        let tone = ToneCurve::fit(&light.surface.radiosity);
        let mut bytes = vec![];
        let is_gltf =
            self.files.with(|file| radiosity::io::gltf_ending(file)).map_err(js)?.is_some();
        if is_gltf {
            let lit = self.files.with(|file| write_lit_gltf(&mut bytes, file, light, None, &tone));
            lit.map_err(js)?;
        } else {
            let mut settings = GlbSettings::from(&tone);
            settings.error = self.baked.estimate.total;
            write_glb(&mut bytes, light, settings).map_err(js)?;
        }
        Ok(bytes)
    }
}

/// The exception for an error of the library.
fn js(error: Error) -> JsError {
    JsError::new(&error.to_string())
}
