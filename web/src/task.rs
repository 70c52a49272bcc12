//! A bake in three calls: what is asked, the work, and what it came to. The middle one has neither
//! arguments nor results, so that JavaScript can suspend it while it waits for a device.

use std::cell::RefCell;
use std::sync::Arc;

use js_sys::Function;
use radiosity::{Backend, Error};
use wasm_bindgen::prelude::*;

use crate::callbacks::Callbacks;
use crate::options::Options;
use crate::{Bake, Files, js};

struct Task {
    files: Files,
    options: Options,
    callbacks: Callbacks,
}

thread_local! {
    static TASK: RefCell<Option<Task>> = const { RefCell::new(None) };
    static BAKED: RefCell<Option<Result<Bake, Error>>> = const { RefCell::new(None) };
}

/// What [`work`] does next: bake the scene of `files` by `options`, an object as JSON.
/// `on_progress(json)` hears how far it is and answers whether to go on; `on_light(light, json)`
/// gets light as it gets better.
#[wasm_bindgen]
pub fn ask(
    files: Files,
    options: &str,
    on_progress: Function,
    on_light: Function,
) -> Result<(), JsError> {
    let options = Options::parse(options).map_err(js)?;
    let task = Task { files, options, callbacks: Callbacks::new(on_progress, on_light) };
    TASK.with_borrow_mut(|slot| *slot = Some(task));
    Ok(())
}

/// Bakes what was asked. The glue of wasm-bindgen does not wrap it: a call that is suspended has no
/// JavaScript between its ends.
#[allow(unsafe_code, reason = "the name of an export")]
#[unsafe(no_mangle)]
pub extern "C" fn work() {
    let Some(task) = TASK.take() else { return };
    let baked = bake(task);
    BAKED.with_borrow_mut(|slot| *slot = Some(baked));
}

/// What [`work`] came to.
#[wasm_bindgen]
pub fn result() -> Result<Bake, JsError> {
    let baked = BAKED.take().ok_or_else(|| JsError::new("nothing was asked"))?;
    baked.map_err(js)
}

fn bake(Task { files, options, mut callbacks }: Task) -> Result<Bake, Error> {
    let scene = Arc::new(files.with(|file| options.scene(file))?);
    callbacks.show_shape(&scene);
    let target = options.target()?;
    let (backend, failure) = options.backend()?;
    let mut baked = target.bake(scene, &backend, |progress| callbacks.hear(progress))?;
    baked.device_failure = failure.or(baked.device_failure);
    Ok(Bake { files, baked, is_on_gpu: !matches!(backend, Backend::Cpu) })
}
